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
STOP_TIME_MARGIN, STOP_TIME_MARGIN_S = 1.5, 0.2
"""Ratio of the limit of the time to stop to the measured time, and time that is added to the limit."""
MIN_STOP_S, MAX_STOP_S = 0.05, 3.0
"""Minimum and maximum time from an outage to a stop that counts as a reaction to the outage."""
MAX_REST_SPEED_M_RAD_S = 0.01
"""Speed in m/s, and turn rate in rad/s, below which the robot is at rest."""
MIN_PATH_M = 1.0
"""Minimum length of a path for which a limit is proposed."""
NON_SENSOR_TARGETS = ("cmd_vel", "wheels", "localizer")
"""Targets of faults that are not sensors."""


@dataclass(frozen=True)
class ProposedCriterion:
    """Criterion for the scenario.

    kind:    YAML key of the criterion
    values:  parameters by YAML key
    reason:  reason for the limit
    """

    kind: str
    values: Mapping[str, object]
    reason: Reason


def propose_criteria(
    drive: RecordedDrive, incidents: Sequence[Incident], faults: Sequence[FoundFault], is_refusal_expected: bool
) -> Iterator[ProposedCriterion]:
    """Yield criteria for a drive. `is_refusal_expected` states that the robot must refuse all goals."""
    violations = {incident.criterion: incident for incident in incidents}
    if drive.goals:
        reason = _limit_reason(violations, "goals_reached", "all goals were reached")
        if "goals_reached" not in violations and any(goal.status not in ("reached", "passed") for goal in drive.goals):
            reason = Reason("the log does not show that all goals were reached", confidence="low")
        yield ProposedCriterion("goals_reached", {}, reason)
    reason = _limit_reason(violations, "collisions", "no contact was recorded")
    if not len(drive.bumper):
        reason = Reason("the log does not show contacts, because it has no bumper", confidence="low")
    yield ProposedCriterion("collisions", {"max": 0}, reason)
    if "stuck" in violations:
        yield ProposedCriterion("stuck", {"max": f"{STUCK_S:g} s"}, _limit_reason(violations, "stuck", ""))
    if drive.has_true_poses and len(belief := belief_with_pose(drive)):
        yield _localization_criterion(drive, belief, violations)
    if not is_refusal_expected and not {"goals_reached", "stuck"} & set(violations):
        yield from _efficiency_criteria(drive)
    yield from _speed_criterion(drive)
    yield from _stop_criterion(drive, faults)


def _speed_criterion(drive: RecordedDrive) -> Iterator[ProposedCriterion]:
    speeds = true_speeds(drive) if drive.has_true_poses else np.hypot(*drive.odometry.values[:, 3:5].T)
    if not len(speeds):
        return
    max_speed = float(np.percentile(speeds, SPEED_PERCENTILE))
    if max_speed > MAX_REST_SPEED_M_RAD_S:
        limit = math.ceil(10 * SPEED_MARGIN * max_speed) / 10
        yield ProposedCriterion("speed", {"max": f"{limit:.1f} m/s"}, Reason(f"held: at most {max_speed:.2f} m/s"))


def _limit_reason(violations: Mapping[str, Incident], criterion: str, held_text: str) -> Reason:
    """Return the incident that violated a criterion as a reason. Without a violation, the reason is `held_text`."""
    incident = violations.get(criterion)
    if incident is None:
        return Reason(f"held: {held_text}")
    return Reason(f"broken: {incident.detail}", incident.time)


def _localization_criterion(
    drive: RecordedDrive, belief: TimedValues, violations: Mapping[str, Incident]
) -> ProposedCriterion:
    errors = np.hypot(*(belief.values[:, :2] - drive.poses.poses_at(belief.times)[:, :2]).T)
    max_error = float(errors.max())
    is_violated = "localization_error" in violations
    limit = LOST_ERROR_M if is_violated else max(MIN_ERROR_LIMIT_M, ERROR_MARGIN * max_error)
    reason = _limit_reason(violations, "localization_error", f"the largest error was {max_error:.2f} m")
    return ProposedCriterion("localization_error", {"max": round(limit, 2)}, reason)


def _efficiency_criteria(drive: RecordedDrive) -> Iterator[ProposedCriterion]:
    """Yield limits for the time to the last goal and the path length, if the last goal has a result."""
    if not drive.goals or drive.goals[-1].end_time is None:
        return
    seconds = drive.goals[-1].end_time - drive.goals[0].sent_time
    limit = max(MIN_TIME_LIMIT_S, TIME_MARGIN * seconds)
    yield ProposedCriterion("time_to_goal", {"max": f"{limit:.0f} s"}, Reason(f"held: it took {seconds:.1f} s"))
    length = path_length(drive.poses.values[:, :2])
    if length > MIN_PATH_M:
        values = {"max": f"{PATH_MARGIN * length:.1f} m"}
        yield ProposedCriterion("path_length", values, Reason(f"held: the robot drove {length:.2f} m"))


def _stop_criterion(drive: RecordedDrive, faults: Sequence[FoundFault]) -> Iterator[ProposedCriterion]:
    """Yield a limit for the time to stop after a sensor outage, if the robot stopped after an outage."""
    for fault in faults:
        if fault.kind != "off" or fault.target in NON_SENSOR_TARGETS or fault.begin is None or fault.duration is None:
            continue
        seconds = time_to_rest(drive, fault.begin, fault.begin + fault.duration)
        if seconds is not None and MIN_STOP_S < seconds < MAX_STOP_S:
            limit = STOP_TIME_MARGIN * seconds + STOP_TIME_MARGIN_S
            values = {"time": f"{limit:.1f} s", "after": f"{fault.target}.off"}
            yield ProposedCriterion("stopped_within", values, Reason(f"held: the robot stopped after {seconds:.2f} s"))
            return


def time_to_rest(drive: RecordedDrive, begin: float, end: float) -> float | None:
    """Return the time in s from `begin` until the robot rests; None if it does not rest before `end`."""
    is_between = (drive.odometry.times >= begin) & (drive.odometry.times <= end)
    speeds = np.abs(drive.odometry.values[is_between][:, 3:6]).max(axis=1) if is_between.any() else np.empty(0)
    rest_indices = np.flatnonzero(speeds < MAX_REST_SPEED_M_RAD_S)
    return float(drive.odometry.times[is_between][rest_indices[0]] - begin) if len(rest_indices) else None


def path_length(positions: Array) -> float:
    """Return the length in m of the path through `positions` (n, 2), without moves shorter than MIN_MOVE_M."""
    if not len(positions):
        return 0.0
    length, last = 0.0, positions[0]
    for position in positions[1:]:
        step = float(np.hypot(*(position - last)))
        if step >= MIN_MOVE_M:
            length, last = length + step, position
    return length
