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
SAME_POSITION_M = 0.3
"""Maximum distance between the two robots at which their scans are compared."""
SAME_RANGE_M = 0.2
"""Maximum difference between two ranges that count as equal."""
MIN_SCANS = 3
"""Number of scans that must confirm the nearest return of a drive, so that single errors are ignored."""
MAX_INCIDENT_DISTANCE_M, MAX_INCIDENT_TIME_S = 1.0, 5.0
"""Maximum distance and time between two incidents of the same kind that count as the same incident."""


@dataclass(frozen=True)
class ComparedQuantity:
    """Row of the comparison as text: name of a quantity, values in log and run, and difference."""

    name: str
    log: str
    run: str
    difference: str


@dataclass(frozen=True)
class ComparedIncident:
    """Incident of the log, and the nearest incident in time of the same kind in the run; None if there is none."""

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
        late = abs(self.repeated.time - self.recorded.time)
        return self.distance <= MAX_INCIDENT_DISTANCE_M and late <= MAX_INCIDENT_TIME_S

    @property
    def sentence(self) -> str:
        """Sentence that states whether the run reproduced the incident."""
        what = f"{self.recorded.kind} at {self.recorded.time:.2f} s ({self.recorded.detail})"
        if self.repeated is None:
            return f"not reproduced: {what}"
        late = self.repeated.time - self.recorded.time
        near = f"{abs(late):.2f} s {'later' if late >= 0 else 'earlier'} and {self.distance:.2f} m away"
        return f"{'reproduced' if self.is_reproduced else 'only similar'}: {what}, {near}"


@dataclass(frozen=True)
class Verification:
    """Result of comparing a recorded drive with a run of its reconstructed scenario.

    Attributes:
        drive: Recorded drive.
        repeated: Drive of the run.
        log: Log of the run.
        quantities: Rows of the comparison.
        incidents: Incidents of the recorded drive with the matching incidents of the run.
        new_incidents: Incidents of the run without a match in the recorded drive.
        failed: Names of the criteria that did not pass in the run.
    """

    drive: RecordedDrive
    repeated: RecordedDrive
    log: Path
    quantities: Sequence[ComparedQuantity]
    incidents: Sequence[ComparedIncident]
    new_incidents: Sequence[Incident]
    failed: Sequence[str]

    @property
    def is_reproduced(self) -> bool:
        """Whether the run reproduced all incidents of the log."""
        return all(incident.is_reproduced for incident in self.incidents)


def compare_with_run(reconstruction: Reconstruction, log: Path) -> Verification:
    """Compare the recorded drive with the log of a run of the scenario.

    Raises InvalidInput for an unusable log, or a log without the result of the run.
    """
    repeated = read_drive(log)
    incidents, others = compare_incidents(find_incidents(reconstruction.drive), find_incidents(repeated))
    result = attached_result(log)
    if result is None:
        raise invalid_log(log, "SC802", "it has no result")
    failed = [verdict["id"] for verdict in result["verdicts"] if verdict["status"] != "pass"]
    quantities = [*compare_drives(reconstruction.drive, repeated)]
    return Verification(reconstruction.drive, repeated, log, quantities, incidents, others, failed)


def compare_incidents(
    recorded: Sequence[Incident], repeated: Sequence[Incident]
) -> tuple[list[ComparedIncident], list[Incident]]:
    """Return the recorded incidents with their matches in the run, and the incidents of the run without a match."""
    left = [*repeated]
    compared = []
    for incident in recorded:
        same = [candidate for candidate in left if candidate.kind == incident.kind]
        nearest = min(same, key=lambda candidate: abs(candidate.time - incident.time), default=None)
        if nearest is not None:
            left.remove(nearest)
        compared.append(ComparedIncident(incident, nearest))
    return compared, left


def compare_drives(recorded: RecordedDrive, repeated: RecordedDrive) -> Iterator[ComparedQuantity]:
    """Yield rows that compare paths, times, clearances, and scans."""
    times = common_times(recorded, repeated)
    apart = distances_between(recorded, repeated, times)
    if len(apart):
        rms = float(np.sqrt(np.mean(apart**2)))
        yield ComparedQuantity("distance at the same time", "", "", f"{rms:.2f} m RMS, at most {apart.max():.2f} m")
    off, _ = cKDTree(recorded.poses.values[:, :2]).query(repeated.poses.values[:, :2])
    yield ComparedQuantity("distance from the log's path", "", "", f"at most {float(np.max(off)):.2f} m")
    lengths = [path_length(drive.poses.values[:, :2]) for drive in (recorded, repeated)]
    yield _numbers("path length", lengths[0], lengths[1], "m")
    yield _numbers("duration", recorded.duration, repeated.duration, "s")
    for goal, again in zip_longest(recorded.goals, repeated.goals[: len(recorded.goals)]):
        if again is None:
            yield ComparedQuantity(f"goal {goal.name}", goal.status, "not sent", "")
        else:
            difference = (
                "" if goal.end_time is None or again.end_time is None else f"{again.end_time - goal.end_time:+.2f} s"
            )
            yield ComparedQuantity(f"goal {goal.name}", _outcome(goal), _outcome(again), difference)
    nearest, nearest_again = nearest_return(recorded), nearest_return(repeated)
    if nearest is not None and nearest_again is not None:
        yield _numbers("nearest return of the lidar", nearest, nearest_again, "m")
    seen = fraction_seen_alike(recorded, repeated, times)
    if seen is not None:
        text = f"{100 * seen:.0f} % within {SAME_RANGE_M:g} m"
        yield ComparedQuantity("ranges at the same place", "", "", text)


def _numbers(name: str, log: float, run: float, unit: str) -> ComparedQuantity:
    difference = round(run - log, 2) + 0.0  # no minus sign before a zero
    return ComparedQuantity(name, f"{log:.2f} {unit}", f"{run:.2f} {unit}", f"{difference:+.2f} {unit}")


def _outcome(goal: RecordedGoal) -> str:
    """Return status, time, and error of a goal as text."""
    end = "" if goal.end_time is None else f" at {goal.end_time:.2f} s"
    return f"{goal.status}{end}{f' ({goal.error})' if goal.error else ''}"


def common_times(recorded: RecordedDrive, repeated: RecordedDrive) -> Array:
    """Return times (n,) in s, every STEP_S, until the shorter of both drives ends."""
    return np.arange(0.0, min(recorded.duration, repeated.duration), STEP_S)


def distances_between(recorded: RecordedDrive, repeated: RecordedDrive, times: Array) -> Array:
    """Return the distances (n,) in m between the robots of both drives at `times` (n,)."""
    apart: Array = np.hypot(*(recorded.poses.poses_at(times)[:, :2] - repeated.poses.poses_at(times)[:, :2]).T)
    return apart


def nearest_returns(drive: RecordedDrive) -> tuple[Array, Array] | None:
    """Return times (n,) in s and smallest ranges (n,) in m of all scans with a return; None without enough scans."""
    if drive.scans is None or len(drive.scans) < MIN_SCANS:
        return None
    nearest = np.where(drive.scans.is_hit(), drive.scans.ranges, np.inf).min(axis=1)
    seen = np.isfinite(nearest)
    return drive.scans.times[seen], nearest[seen]


def nearest_return(drive: RecordedDrive) -> float | None:
    """Return the nearest return of a drive in m, robust against single errors; None without enough scans."""
    found = nearest_returns(drive)
    if found is None or len(found[1]) < MIN_SCANS:
        return None
    return float(np.sort(found[1])[MIN_SCANS - 1])


def _hits(scans: Scans) -> Array:
    """Return the ranges (n, beams) in m, with nan for beams without a return."""
    return np.where(scans.is_hit(), scans.ranges, np.nan)


def fraction_seen_alike(recorded: RecordedDrive, repeated: RecordedDrive, times: Array) -> float | None:
    """Return the fraction of beams with equal ranges at the `times` (n,) at which both robots are near each other.

    Beams with the same direction in the map frame are compared. Return None if there are none.
    """
    one, other = recorded.scans, repeated.scans
    if one is None or other is None or not len(one) or not len(other) or len(other.angles) < 2:
        return None
    near = distances_between(recorded, repeated, times) < SAME_POSITION_M
    first = np.clip(np.searchsorted(one.times, times[near]), 0, len(one) - 1)
    second = np.clip(np.searchsorted(other.times, times[near]), 0, len(other) - 1)
    if not len(first):
        return None
    headings = recorded.poses.poses_at(one.times[first])[:, 2] - repeated.poses.poses_at(other.times[second])[:, 2]
    directions = headings[:, None] + one.mount.yaw - other.mount.yaw + one.angles - other.angles[0]
    step, last = float(other.angles[1] - other.angles[0]), len(other.angles) - 1
    beams = (np.mod(np.sign(step) * directions + abs(step) / 2, 2 * np.pi) / abs(step)).astype(int)
    a, b = _hits(one)[first], _hits(other)[second[:, None], np.minimum(beams, last)]
    both = np.isfinite(a) & np.isfinite(b) & (beams <= last)
    if not both.any():
        return None
    return float(np.mean(np.abs(a[both] - b[both]) <= SAME_RANGE_M))
