"""Compares a run of a reconstructed scenario with the recorded drive: paths, times, scans, and incidents.

The two drives are the drive in the log (`recorded`) and the drive of the run (`repeated`), with one robot each.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from simscen.core.geometry import Array
from simscen.reconstruction.drive.reader import read_drive
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, RecordedGoal, Scans
from simscen.reconstruction.scenario.criteria import path_length
from simscen.reconstruction.scenario.incidents import Incident, find_incidents
from simscen.reconstruction.scenario_from_log import Reconstruction
from simscen.record.log_reader import invalid_log
from simscen.record.mcap_reader import attached_result

STEP_S = 0.1
"""Time between two compared positions."""
MAX_SAME_POSITION_M = 0.3
"""Maximum distance between the two robots at which their scans are compared."""
MAX_SAME_RANGE_M = 0.2
"""Maximum difference between two ranges that count as equal."""
MIN_SCANS = 3
"""Number of scans with a return at most as near as the nearest return of a drive, so that single errors are ignored."""
MAX_INCIDENT_DISTANCE_M, MAX_INCIDENT_TIME_S = 1.0, 5.0
"""Maximum distance and time between two incidents of the same kind that count as the same incident."""


@dataclass(frozen=True)
class ComparedQuantity:
    """Row of the comparison as text: name of a quantity, value in the log, value in the run, and difference.

    Values that do not exist are "".
    """

    name: str
    log: str
    run: str
    difference: str


@dataclass(frozen=True)
class ComparedIncident:
    """Incident of the log, and the incident of the same kind in the run that is nearest in time.

    `repeated` is None if the run has no such incident.
    """

    recorded: Incident
    repeated: Incident | None

    @property
    def distance(self) -> float:
        """Distance in m between the positions of both incidents; inf if the run has no such incident."""
        if self.repeated is None:
            return float("inf")
        return float(np.hypot(*(np.array(self.recorded.position) - np.array(self.repeated.position))))

    @property
    def is_reproduced(self) -> bool:
        """Whether both incidents are close in position and time."""
        if self.repeated is None:
            return False
        time_difference = abs(self.repeated.time - self.recorded.time)
        return self.distance <= MAX_INCIDENT_DISTANCE_M and time_difference <= MAX_INCIDENT_TIME_S

    @property
    def sentence(self) -> str:
        """Sentence that states whether the run reproduced the incident."""
        incident = f"{self.recorded.kind} at {self.recorded.time:.2f} s ({self.recorded.detail})"
        if self.repeated is None:
            return f"not reproduced: {incident}"
        delay = self.repeated.time - self.recorded.time
        difference = f"{abs(delay):.2f} s {'later' if delay >= 0 else 'earlier'} and {self.distance:.2f} m away"
        return f"{'reproduced' if self.is_reproduced else 'only similar'}: {incident}, {difference}"


@dataclass(frozen=True)
class Verification:
    """Result of comparing a recorded drive with a run of its reconstructed scenario.

    Attributes:
        recorded: Recorded drive.
        repeated: Drive of the run.
        log: Log of the run.
        quantities: Rows of the comparison.
        incidents: Incidents of the recorded drive with the matching incidents of the run.
        new_incidents: Incidents of the run without a match in the recorded drive.
        failed_criteria: Names of the criteria that did not pass in the run.
    """

    recorded: RecordedDrive
    repeated: RecordedDrive
    log: Path
    quantities: Sequence[ComparedQuantity]
    incidents: Sequence[ComparedIncident]
    new_incidents: Sequence[Incident]
    failed_criteria: Sequence[str]

    @property
    def is_reproduced(self) -> bool:
        """Whether the run reproduced all incidents of the log."""
        return all(incident.is_reproduced for incident in self.incidents)


def compare_with_run(reconstruction: Reconstruction, log: Path) -> Verification:
    """Compare the recorded drive with the log of a run of the scenario.

    Raises InvalidInput for an unusable log, or a log without the result of the run.
    """
    repeated = read_drive(log)
    incidents, new_incidents = compare_incidents(find_incidents(reconstruction.drive), find_incidents(repeated))
    result = attached_result(log)
    if result is None:
        raise invalid_log(log, "SC802", "it has no result")
    failed_criteria = [verdict["id"] for verdict in result["verdicts"] if verdict["status"] != "pass"]
    quantities = [*compare_drives(reconstruction.drive, repeated)]
    return Verification(reconstruction.drive, repeated, log, quantities, incidents, new_incidents, failed_criteria)


def compare_incidents(
    recorded: Sequence[Incident], repeated: Sequence[Incident]
) -> tuple[list[ComparedIncident], list[Incident]]:
    """Return the recorded incidents with their matches in the run, and the incidents of the run without a match."""
    unmatched = [*repeated]
    compared = []
    for incident in recorded:
        candidates = [candidate for candidate in unmatched if candidate.kind == incident.kind]
        nearest = min(candidates, key=lambda candidate: abs(candidate.time - incident.time), default=None)
        if nearest is not None:
            unmatched.remove(nearest)
        compared.append(ComparedIncident(incident, nearest))
    return compared, unmatched


def compare_drives(recorded: RecordedDrive, repeated: RecordedDrive) -> Iterator[ComparedQuantity]:
    """Yield rows that compare paths, times, clearances, and scans."""
    times = common_times(recorded, repeated)
    distances = distances_between(recorded, repeated, times)
    if len(distances):
        rms, largest = float(np.sqrt(np.mean(distances**2))), distances.max()
        yield ComparedQuantity("distance at the same time", "", "", f"{rms:.2f} m RMS, at most {largest:.2f} m")
    path_distances, _ = cKDTree(recorded.poses.values[:, :2]).query(repeated.poses.values[:, :2])
    yield ComparedQuantity("distance from the log's path", "", "", f"at most {float(np.max(path_distances)):.2f} m")
    lengths = [path_length(drive.poses.values[:, :2]) for drive in (recorded, repeated)]
    yield _compare_numbers("path length", lengths[0], lengths[1], "m")
    yield _compare_numbers("duration", recorded.duration, repeated.duration, "s")
    for goal, repeated_goal in zip_longest(recorded.goals, repeated.goals[: len(recorded.goals)]):
        yield _compare_goals(goal, repeated_goal)
    recorded_return, repeated_return = nearest_return(recorded), nearest_return(repeated)
    if recorded_return is not None and repeated_return is not None:
        yield _compare_numbers("nearest return of the lidar", recorded_return, repeated_return, "m")
    equal_fraction = fraction_of_equal_ranges(recorded, repeated, times)
    if equal_fraction is not None:
        text = f"{100 * equal_fraction:.0f} % within {MAX_SAME_RANGE_M:g} m"
        yield ComparedQuantity("ranges at the same place", "", "", text)


def _compare_numbers(name: str, log: float, run: float, unit: str) -> ComparedQuantity:
    difference = round(run - log, 2) + 0.0  # no minus sign before a zero
    return ComparedQuantity(name, f"{log:.2f} {unit}", f"{run:.2f} {unit}", f"{difference:+.2f} {unit}")


def _compare_goals(goal: RecordedGoal, repeated: RecordedGoal | None) -> ComparedQuantity:
    """Compare a goal of the log with the goal of the run; None if the goal was not sent in the run."""
    if repeated is None:
        return ComparedQuantity(f"goal {goal.name}", goal.status, "not sent", "")
    difference = ""
    if goal.end_time is not None and repeated.end_time is not None:
        difference = f"{repeated.end_time - goal.end_time:+.2f} s"
    return ComparedQuantity(f"goal {goal.name}", _outcome(goal), _outcome(repeated), difference)


def _outcome(goal: RecordedGoal) -> str:
    """Return status, time, and error of a goal as text."""
    end = "" if goal.end_time is None else f" at {goal.end_time:.2f} s"
    return f"{goal.status}{end}{f' ({goal.error})' if goal.error else ''}"


def common_times(recorded: RecordedDrive, repeated: RecordedDrive) -> Array:
    """Return times (n,) in s, every STEP_S, until the shorter of both drives ends."""
    return np.arange(0.0, min(recorded.duration, repeated.duration), STEP_S)


def distances_between(recorded: RecordedDrive, repeated: RecordedDrive, times: Array) -> Array:
    """Return the distances (n,) in m between the robots of both drives at `times` (n,)."""
    distances: Array = np.hypot(*(recorded.poses.poses_at(times)[:, :2] - repeated.poses.poses_at(times)[:, :2]).T)
    return distances


def nearest_returns(drive: RecordedDrive) -> tuple[Array, Array] | None:
    """Return times (n,) in s and smallest ranges (n,) in m of all scans with a return; None without enough scans."""
    if drive.scans is None or len(drive.scans) < MIN_SCANS:
        return None
    nearest = np.where(drive.scans.is_hit(), drive.scans.ranges, np.inf).min(axis=1)
    has_return = np.isfinite(nearest)
    return drive.scans.times[has_return], nearest[has_return]


def nearest_return(drive: RecordedDrive) -> float | None:
    """Return the range in m of the nearest return in a drive; None without enough scans.

    MIN_SCANS scans have a return at most this far, so that single errors have no effect.
    """
    returns = nearest_returns(drive)
    if returns is None or len(returns[1]) < MIN_SCANS:
        return None
    return float(np.sort(returns[1])[MIN_SCANS - 1])


def _ranges_of_hits(scans: Scans) -> Array:
    """Return the ranges (n, beams) in m, with nan for beams without a return."""
    return np.where(scans.is_hit(), scans.ranges, np.nan)


def fraction_of_equal_ranges(recorded: RecordedDrive, repeated: RecordedDrive, times: Array) -> float | None:
    """Return the fraction of beams with equal ranges at the `times` (n,) at which both robots are near each other.

    Beams with the same direction in the map frame are compared. Return None if there are no such beams.
    """
    first, second = recorded.scans, repeated.scans
    if first is None or second is None or not len(first) or not len(second) or len(second.angles) < 2:
        return None
    near_times = times[distances_between(recorded, repeated, times) < MAX_SAME_POSITION_M]
    first_rows = np.clip(np.searchsorted(first.times, near_times), 0, len(first) - 1)
    second_rows = np.clip(np.searchsorted(second.times, near_times), 0, len(second) - 1)
    if not len(near_times):
        return None
    first_yaws = recorded.poses.poses_at(first.times[first_rows])[:, 2]
    second_yaws = repeated.poses.poses_at(second.times[second_rows])[:, 2]
    yaws = first_yaws + first.mount.yaw - second_yaws - second.mount.yaw
    angles = yaws[:, None] + first.angles - second.angles[0]
    step, last_beam = float(second.angles[1] - second.angles[0]), len(second.angles) - 1
    beams = (np.mod(np.sign(step) * angles + abs(step) / 2, 2 * np.pi) / abs(step)).astype(int)
    first_ranges = _ranges_of_hits(first)[first_rows]
    second_ranges = _ranges_of_hits(second)[second_rows[:, None], np.minimum(beams, last_beam)]
    is_compared = np.isfinite(first_ranges) & np.isfinite(second_ranges) & (beams <= last_beam)
    if not is_compared.any():
        return None
    return float(np.mean(np.abs(first_ranges[is_compared] - second_ranges[is_compared]) <= MAX_SAME_RANGE_M))
