"""Whether there can be a plan at all: start and goal are checked before any search, with Nav2's codes."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import label

from simscen.core.geometry import Pose2
from simscen.core.navigation import ErrorCode
from simscen.stack.planners.field import Field
from simscen.stack.protocols import NavigationFailure

ESCAPE = 0.5
"""How far in metres a robot that stands too near an obstacle may drive to where a plan can begin."""


@dataclass(frozen=True)
class Ends:
    """Where the search begins and ends; they differ from what was asked where the robot could not stand there."""

    start: tuple[float, float]
    goal: tuple[float, float]


def roomier_ends(field: Field, ends: Ends, radius: float, inscribed: float) -> Ends | None:
    """The ends of a search for a larger disc than the robot; None when it cannot get through, or not to its ends.

    From each end there must be a straight way to the new one for the robot itself (`inscribed`).
    """
    free = field.costmap.distance > radius
    start = _nearest(field, free, Pose2(*ends.start), ESCAPE)
    goal = _nearest(field, free, Pose2(*ends.goal), ESCAPE)
    if start is None or goal is None:
        return None
    pieces, _ = label(free)
    connected = pieces[_cell(field, start)] == pieces[_cell(field, goal)]
    straight = field.segment_free(*ends.start, *start, inscribed) and field.segment_free(*goal, *ends.goal, inscribed)
    return Ends(start, goal) if connected and straight else None


def find_ends(field: Field, start: Pose2, goal: Pose2, radius: float, tolerance: float) -> Ends:
    """The ends of a search for a disc of `radius`.

    A start nearer to an obstacle than that is moved to the nearest free place (the robot is there already). A goal
    is moved to the nearest place within `tolerance` that can be reached. Raises NavigationFailure with
    START_/GOAL_OUTSIDE_MAP, START_/GOAL_OCCUPIED or NO_VALID_PATH.
    """
    _inside(field, start, ErrorCode.START_OUTSIDE_MAP, "start")
    _inside(field, goal, ErrorCode.GOAL_OUTSIDE_MAP, "goal")
    if field.at(start.x, start.y) == 0.0:
        raise NavigationFailure(ErrorCode.START_OCCUPIED, f"start ({start.x:.2f}, {start.y:.2f}) is in an obstacle")
    if field.at(goal.x, goal.y) == 0.0:
        raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, f"goal ({goal.x:.2f}, {goal.y:.2f}) is in an obstacle")
    free = field.costmap.distance > radius
    begin = _nearest(field, free, start, ESCAPE)
    if begin is None:
        raise NavigationFailure(ErrorCode.START_OCCUPIED, f"no free place within {ESCAPE} m of the start")
    if _nearest(field, free, goal, tolerance) is None:
        raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, f"no room for the robot within {tolerance} m of the goal")
    pieces, _ = label(free)
    end = _nearest(field, pieces == pieces[_cell(field, begin)], goal, tolerance)
    if end is None:
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, "start and goal are not connected")
    return Ends(begin, end)


def _inside(field: Field, pose: Pose2, code: ErrorCode, what: str) -> None:
    if field.at(pose.x, pose.y) < 0:
        raise NavigationFailure(code, f"{what} ({pose.x:.2f}, {pose.y:.2f}) is outside the map")


def _cell(field: Field, point: tuple[float, float]) -> tuple[int, int]:
    return (
        math.floor((point[1] - field.origin[1]) / field.resolution),
        math.floor((point[0] - field.origin[0]) / field.resolution),
    )


def _nearest(field: Field, free: npt.NDArray[np.bool_], pose: Pose2, within: float) -> tuple[float, float] | None:
    """The point itself if its cell is free, else the centre of the nearest free cell, at most `within` away."""
    row, column = _cell(field, (pose.x, pose.y))
    if free[row, column]:
        return pose.x, pose.y
    reach = math.ceil(within / field.resolution)
    top, left = max(0, row - reach), max(0, column - reach)
    cells = np.argwhere(free[top : row + reach + 1, left : column + reach + 1]) + np.array((top, left))
    x = field.origin[0] + (cells[:, 1] + 0.5) * field.resolution
    y = field.origin[1] + (cells[:, 0] + 0.5) * field.resolution
    distance = np.hypot(x - pose.x, y - pose.y)
    if not len(cells) or distance.min() > within:
        return None
    best = int(np.argmin(distance))
    return float(x[best]), float(y[best])
