"""Proposes criteria for a scenario: limits that the drive met with a margin, and limits that an incident violated."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array
from simscen.criteria.trace_signals.ground_truth import MIN_MOVE_M
from simscen.reconstruction.drive.gaps import belief_with_pose
from simscen.reconstruction.drive.motion_steps import true_speeds
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, TimedValues
from simscen.reconstruction.reasons import FoundFault, Reason
from simscen.reconstruction.scenario.incidents import LOST_ERROR_M, STUCK_S, Incident

TIME_MARGIN, PATH_MARGIN, ERROR_MARGIN = 1.25, 1.25, 1.5
"""Ratios of the limits of time, path length, and localization error to the values in the drive."""
MIN_ERROR_LIMIT_M, MIN_TIME_LIMIT_S = 0.25, 10.0
"""Minimum limits of the localization error and of the time to the goal."""
SPEED_PERCENTILE, SPEED_MARGIN = 99.5, 1.25
"""Percentile that is used as the maximum of the noisy speeds, and ratio of the speed limit to this maximum."""
STOP_TIME_FACTOR, MAX_STOP_S = 1.5, 3.0
"""Ratio of the limit (minus 0.2 s) to the measured time to stop, and maximum time from a fault to its stop."""
REST_SPEED_M_S = 0.01
"""Speed in m/s, and turn rate in rad/s, below which the robot is at rest."""
NON_SENSOR_TARGETS = ("cmd_vel", "wheels", "localizer")
"""Targets of faults that are not sensors."""


@dataclass(frozen=True)
class ProposedCriterion:
    """Criterion for the scenario: YAML key, parameters by YAML key, and reason for the limit."""

    kind: str
    values: Mapping[str, object]
    reason: Reason


def propose_criteria(
    drive: RecordedDrive, incidents: Sequence[Incident], faults: Sequence[FoundFault], is_refusal_expected: bool
) -> Iterator[ProposedCriterion]:
    """Yield criteria for a drive. `is_refusal_expected` states that the robot must refuse all goals."""
    broken = {incident.criterion: incident for incident in incidents}
    if drive.goals:
        goals = _limit_reason(broken, "goals_reached", "all goals were reached")
        if "goals_reached" not in broken and any(goal.status not in ("reached", "passed") for goal in drive.goals):
            goals = Reason("the log does not show that all goals were reached", confidence="low")
        yield ProposedCriterion("goals_reached", {}, goals)
    contact = _limit_reason(broken, "collisions", "no contact was recorded")
    if not len(drive.bumper):
        contact = Reason("the log does not show contacts, because it has no bumper", confidence="low")
    yield ProposedCriterion("collisions", {"max": 0}, contact)
    if "stuck" in broken:
        yield ProposedCriterion("stuck", {"max": f"{STUCK_S:g} s"}, _limit_reason(broken, "stuck", ""))
    if drive.has_true_poses and len(belief := belief_with_pose(drive)):
        yield _localization(drive, belief, broken)
    if not is_refusal_expected and not {"goals_reached", "stuck"} & set(broken):
        yield from _efficiency(drive)
    yield from _speed(drive)
    yield from _stops(drive, faults)


def _speed(drive: RecordedDrive) -> Iterator[ProposedCriterion]:
    speeds = true_speeds(drive) if drive.has_true_poses else np.hypot(*drive.odometry.values[:, 3:5].T)
    if not len(speeds):
        return
    fastest = float(np.percentile(speeds, SPEED_PERCENTILE))
    if fastest > REST_SPEED_M_S:
        limit = math.ceil(10 * SPEED_MARGIN * fastest) / 10
        yield ProposedCriterion("speed", {"max": f"{limit:.1f} m/s"}, Reason(f"held: at most {fastest:.2f} m/s"))


def _limit_reason(broken: Mapping[str, Incident], criterion: str, held: str) -> Reason:
    """Return the incident that violated the criterion as a reason, or the text `held` if there is none."""
    incident = broken.get(criterion)
    if incident is None:
        return Reason(f"held: {held}")
    return Reason(f"broken: {incident.detail}", incident.time)


def _localization(drive: RecordedDrive, belief: TimedValues, broken: Mapping[str, Incident]) -> ProposedCriterion:
    errors = np.hypot(*(belief.values[:, :2] - drive.poses.poses_at(belief.times)[:, :2]).T)
    largest = float(errors.max())
    limit = LOST_ERROR_M if "localization_error" in broken else max(MIN_ERROR_LIMIT_M, ERROR_MARGIN * largest)
    text = f"the largest error was {largest:.2f} m"
    return ProposedCriterion(
        "localization_error", {"max": round(limit, 2)}, _limit_reason(broken, "localization_error", text)
    )


def _efficiency(drive: RecordedDrive) -> Iterator[ProposedCriterion]:
    if not drive.goals or drive.goals[-1].end_time is None:
        return
    took = drive.goals[-1].end_time - drive.goals[0].sent_time
    limit = max(MIN_TIME_LIMIT_S, TIME_MARGIN * took)
    yield ProposedCriterion("time_to_goal", {"max": f"{limit:.0f} s"}, Reason(f"held: it took {took:.1f} s"))
    length = path_length(drive.poses.values[:, :2])
    if length > 1.0:
        values = {"max": f"{PATH_MARGIN * length:.1f} m"}
        yield ProposedCriterion("path_length", values, Reason(f"held: the robot drove {length:.2f} m"))


def _stops(drive: RecordedDrive, faults: Sequence[FoundFault]) -> Iterator[ProposedCriterion]:
    """Yield a limit for the time to stop after a sensor outage, if the robot stopped after an outage."""
    for fault in faults:
        if fault.kind != "off" or fault.target in NON_SENSOR_TARGETS or fault.begin is None or fault.duration is None:
            continue
        stop = time_to_rest(drive, fault.begin, fault.begin + fault.duration)
        if stop is not None and 0.05 < stop < MAX_STOP_S:
            values = {"time": f"{STOP_TIME_FACTOR * stop + 0.2:.1f} s", "after": f"{fault.target}.off"}
            yield ProposedCriterion("stopped_within", values, Reason(f"held: the robot stopped after {stop:.2f} s"))
            return


def time_to_rest(drive: RecordedDrive, begin: float, end: float) -> float | None:
    """Return the time in s from `begin` until the robot rests; None if it does not rest before `end`."""
    chosen = (drive.odometry.times >= begin) & (drive.odometry.times <= end)
    speeds = np.abs(drive.odometry.values[chosen][:, 3:6]).max(axis=1) if chosen.any() else np.empty(0)
    rest = np.flatnonzero(speeds < REST_SPEED_M_S)
    return float(drive.odometry.times[chosen][rest[0]] - begin) if len(rest) else None


def path_length(positions: Array) -> float:
    """Return the length in m of the path through positions (n, 2), without moves shorter than MIN_MOVE_M."""
    if not len(positions):
        return 0.0
    length, last = 0.0, positions[0]
    for place in positions[1:]:
        step = float(np.hypot(*(place - last)))
        if step >= MIN_MOVE_M:
            length, last = length + step, place
    return length
