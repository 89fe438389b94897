"""Finds the incidents of a drive: contacts, standstills, wrong localization, failed goals, and unfinished goals."""

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
"""A robot with a goal is stuck if it stays in a circle of this radius for this time, as in Nav2's progress checker."""
MAX_COMMAND_HOLD_S = 0.5
"""Maximum time for which a base executes a command if no new command arrives."""
LOST_ERROR_M = 0.5
"""Localization error above which the robot is lost."""
MAX_STD_M = 1.0
"""Standard deviation of the estimated position above which the robot is lost, for logs without a ground truth."""


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
    found = [*_contacts(drive), *_standstills(drive), *_lost(drive), *_goals(drive)]
    return sorted(found, key=lambda incident: (incident.time, incident.kind))


def _position(drive: RecordedDrive, time: float) -> tuple[float, float]:
    x, y, _ = drive.poses.poses_at(np.array([time]))[0].tolist()
    return x, y


def _contacts(drive: RecordedDrive) -> Iterator[Incident]:
    for pressed in find_windows(drive.bumper.values[:, 0] > 0.5, drive.bumper.times, max_gap=0.3):
        detail = f"the bumper was pressed for {max(pressed.length, 0.05):.2f} s"
        yield Incident("contact", pressed.begin, _position(drive, pressed.begin), detail, "collisions")


def _standstills(drive: RecordedDrive) -> Iterator[Incident]:
    """Yield the longest standstill on the way to each goal if it lasts longer than STUCK_S.

    If the goal was derived from the driven path, the robot must also have been commanded to drive away.
    """
    for goal in drive.goals:
        end = drive.duration if goal.end_time is None else goal.end_time
        chosen = (drive.poses.times >= goal.sent_time) & (drive.poses.times <= end)
        times, positions = drive.poses.times[chosen], drive.poses.values[chosen, :2]
        begin, length = longest_stay(times, positions, STUCK_RADIUS_M)
        is_estimated = goal.source in (STOP_SOURCE, BEND_SOURCE)
        if length > STUCK_S and (not is_estimated or _is_commanded_to_leave(drive.commands, begin, begin + length)):
            detail = f"the robot stayed within {STUCK_RADIUS_M} m for {length:.1f} s"
            yield Incident("stuck", begin, _position(drive, begin), detail, "stuck")


def _is_commanded_to_leave(commands: TimedValues, begin: float, end: float) -> bool:
    """Return whether the commands between two times in s would have moved the robot out of the circle of its stay."""
    inside = (commands.times >= begin) & (commands.times <= end)
    held = np.minimum(np.diff(commands.times[inside], append=end), MAX_COMMAND_HOLD_S)
    return float(np.hypot(*(commands.values[inside, :2].T @ held))) > 2 * STUCK_RADIUS_M


def longest_stay(times: Array, positions: Array, radius: float) -> tuple[float, float]:
    """Return start and duration in s of the longest stay within `radius` m of a position; (0, 0) without positions.

    `positions` is (n, 2) in m, `times` is (n,) in s.
    """
    best, begin = 0.0, 0.0
    at = 0
    while at < len(times):
        away = np.flatnonzero(np.hypot(*(positions[at:] - positions[at]).T) > radius)
        end = at + (int(away[0]) if len(away) else len(times) - at)
        last = min(end, len(times) - 1)
        if times[last] - times[at] > best:
            best, begin = float(times[last] - times[at]), float(times[at])
        if not len(away):
            break
        at += max(1, int(np.searchsorted(times[at:], times[at] + 0.25)))
    return begin, best


def _lost(drive: RecordedDrive) -> Iterator[Incident]:
    """Yield an incident for each time window in which the belief was wrong or, without a ground truth, uncertain."""
    belief = belief_with_pose(drive) if drive.has_true_poses else drive.belief
    if not len(belief):
        return
    if drive.has_true_poses:
        errors = np.hypot(*(belief.values[:, :2] - drive.poses.poses_at(belief.times)[:, :2]).T)
        for window in find_windows(errors > LOST_ERROR_M, belief.times, max_gap=1.0):
            largest = float(errors[window.samples].max())
            detail = f"the localization error reached {largest:.2f} m"
            yield Incident("lost", window.begin, _position(drive, window.begin), detail, "localization_error")
        return
    deviation = np.sqrt(np.maximum(belief.values[:, 3], belief.values[:, 6]))
    for window in find_windows(deviation > MAX_STD_M, belief.times, min_length=0.5, max_gap=1.0):
        detail = f"the localizer reported a standard deviation of {float(deviation[window.samples].max()):.2f} m"
        yield Incident("lost", window.begin, _position(drive, window.begin), detail, "localization_error")


def _goals(drive: RecordedDrive) -> Iterator[Incident]:
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
