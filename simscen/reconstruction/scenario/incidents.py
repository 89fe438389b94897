"""Finds the incidents of a drive: contacts, standstills, lost localization, failed goals, and unfinished goals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.gaps import belief_with_pose
from simscen.reconstruction.drive.goals import BEND_SOURCE, STOP_SOURCE
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, TimedValues
from simscen.reconstruction.reasons import find_windows

STUCK_RADIUS_M, STUCK_S = 0.5, 10.0
"""Radius of a circle and time: a robot with a goal is stuck if it stays in the circle for this time, as in Nav2's
progress checker."""
MAX_COMMAND_HOLD_S = 0.5
"""Maximum time for which a base executes a command if no new command arrives."""
LOST_ERROR_M = 0.5
"""Localization error above which the robot is lost."""
LOST_STD_M, MIN_LOST_STD_S = 1.0, 0.5
"""For logs without a ground truth: standard deviation of the estimated position above which the robot is lost, and
minimum duration."""
MAX_LOST_GAP_S, MAX_CONTACT_GAP_S = 1.0, 0.3
"""Maximum times between two errors, and between two contacts, that are the same incident."""
STAY_STEP_S = 0.25
"""Time between the starts of stays that `longest_stay` compares."""


@dataclass(frozen=True)
class Incident:
    """Something that went wrong in a drive.

    Attributes:
        kind: "contact", "stuck", "lost", "failed goal", or "unfinished goal".
        time: Start in s.
        position: Position (x, y) of the robot in m in the map frame at this time.
        detail: Description of the incident.
        criterion: Name of the criterion that the incident violates.
    """

    kind: str
    time: float
    position: tuple[float, float]
    detail: str
    criterion: str


def find_incidents(drive: RecordedDrive) -> list[Incident]:
    """Return the incidents of a drive in order of time."""
    incidents = [*_contacts(drive), *_standstills(drive), *_lost_localization(drive), *_goal_incidents(drive)]
    return sorted(incidents, key=lambda incident: (incident.time, incident.kind))


def _position(drive: RecordedDrive, time: float) -> tuple[float, float]:
    """Return the position (x, y) of the robot in the map frame at a time in s."""
    x, y, _ = drive.poses.poses_at(np.array([time]))[0].tolist()
    return x, y


def _contacts(drive: RecordedDrive) -> Iterator[Incident]:
    """Yield an incident for each time window in which the bumper was pressed."""
    for window in find_windows(drive.bumper.values[:, 0] > 0.5, drive.bumper.times, max_gap=MAX_CONTACT_GAP_S):
        detail = f"the bumper was pressed for {max(window.length, 0.05):.2f} s"
        yield Incident("contact", window.begin, _position(drive, window.begin), detail, "collisions")


def _standstills(drive: RecordedDrive) -> Iterator[Incident]:
    """Yield the longest standstill on the way to each goal if it lasts longer than STUCK_S.

    If the goal was derived from the driven path, the robot must also have been commanded to drive away.
    """
    for goal in drive.goals:
        end = drive.duration if goal.end_time is None else goal.end_time
        is_active = (drive.poses.times >= goal.sent_time) & (drive.poses.times <= end)
        times, positions = drive.poses.times[is_active], drive.poses.values[is_active, :2]
        begin, length = longest_stay(times, positions, STUCK_RADIUS_M)
        is_from_path = goal.source in (STOP_SOURCE, BEND_SOURCE)
        if length > STUCK_S and (not is_from_path or _is_commanded_to_leave(drive.commands, begin, begin + length)):
            detail = f"the robot stayed within {STUCK_RADIUS_M} m for {length:.1f} s"
            yield Incident("stuck", begin, _position(drive, begin), detail, "stuck")


def _is_commanded_to_leave(commands: TimedValues, begin: float, end: float) -> bool:
    """Return whether the commands between two times in s would have moved the robot out of the circle of its stay."""
    is_between = (commands.times >= begin) & (commands.times <= end)
    durations = np.minimum(np.diff(commands.times[is_between], append=end), MAX_COMMAND_HOLD_S)
    return float(np.hypot(*(commands.values[is_between, :2].T @ durations))) > 2 * STUCK_RADIUS_M


def longest_stay(times: Array, positions: Array, radius: float) -> tuple[float, float]:
    """Return start and duration in s of the longest stay within `radius` m of a position; (0, 0) without positions.

    `positions` (n, 2) are in m at `times` (n,) in s.
    """
    longest, begin = 0.0, 0.0
    first = 0
    while first < len(times):
        far = np.flatnonzero(np.hypot(*(positions[first:] - positions[first]).T) > radius)
        end = first + (int(far[0]) if len(far) else len(times) - first)
        last = min(end, len(times) - 1)
        if times[last] - times[first] > longest:
            longest, begin = float(times[last] - times[first]), float(times[first])
        if not len(far):
            break
        first += max(1, int(np.searchsorted(times[first:], times[first] + STAY_STEP_S)))
    return begin, longest


def _lost_localization(drive: RecordedDrive) -> Iterator[Incident]:
    """Yield an incident for each time window in which the belief was wrong or, without a ground truth, uncertain."""
    belief = belief_with_pose(drive) if drive.has_true_poses else drive.belief
    if not len(belief):
        return
    if drive.has_true_poses:
        errors = np.hypot(*(belief.values[:, :2] - drive.poses.poses_at(belief.times)[:, :2]).T)
        for window in find_windows(errors > LOST_ERROR_M, belief.times, max_gap=MAX_LOST_GAP_S):
            detail = f"the localization error reached {float(errors[window.samples].max()):.2f} m"
            yield Incident("lost", window.begin, _position(drive, window.begin), detail, "localization_error")
        return
    stds = np.sqrt(np.maximum(belief.values[:, 3], belief.values[:, 6]))
    for window in find_windows(stds > LOST_STD_M, belief.times, MIN_LOST_STD_S, MAX_LOST_GAP_S):
        detail = f"the localizer reported a standard deviation of {float(stds[window.samples].max()):.2f} m"
        yield Incident("lost", window.begin, _position(drive, window.begin), detail, "localization_error")


def _goal_incidents(drive: RecordedDrive) -> Iterator[Incident]:
    """Yield an incident for each failed goal, and for the last goal if it has no result."""
    for number, goal in enumerate(drive.goals):
        if goal.status == "failed" and goal.end_time is not None:
            code = f" with {goal.error}" if goal.error else ""
            yield Incident(
                "failed goal",
                goal.end_time,
                _position(drive, goal.end_time),
                f"`{goal.name}` failed{code}",
                "goals_reached",
            )
        elif goal.end_time is None and number == len(drive.goals) - 1:
            detail = f"`{goal.name}` has no result when the log ends"
            yield Incident("unfinished goal", drive.duration, _position(drive, drive.duration), detail, "goals_reached")
