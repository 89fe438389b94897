"""A window that the robot carries around: obstacles in it persist, what leaves it is forgotten."""

import math
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2
from simscen.stack.costmap.frame import Frame

Cell = TypeVar("Cell", bound=np.generic)

EDGE = 0.6
"""Meters inside the window's edge where a goal beyond it is aimed at."""
FOLLOW = 1 / 8
"""The window is moved when the robot is this part of its size away from its middle, …"""
NO_FARTHER = 0.25
"""… and a local costmap's at the latest when it is so many meters away: Nav2 moves it at each update."""


def window_around(center: Pose2, size: tuple[float, float], resolution: float) -> Frame:
    """A window of so many meters along x and y around a point; its cells are always the same ones of the plane."""
    columns, rows = (math.ceil(edge / resolution) for edge in size)
    column, row = round(center.x / resolution) - columns // 2, round(center.y / resolution) - rows // 2
    return Frame((column * resolution, row * resolution), resolution, (rows, columns))


def left_behind(frame: Frame, base: Pose2, no_farther: float = math.inf) -> bool:
    """Whether the robot has come so far from the middle that the window should follow."""
    rows, columns = frame.shape
    across, up = columns * frame.resolution, rows * frame.resolution
    off = abs(base.x - frame.origin[0] - across / 2), abs(base.y - frame.origin[1] - up / 2)
    return off[0] > min(FOLLOW * across, no_farther) or off[1] > min(FOLLOW * up, no_farther)


def carried(layer: npt.NDArray[Cell], before: Frame, now: Frame, new: float) -> npt.NDArray[Cell]:
    """The cells of a window in an equal one elsewhere in the plane; `new` where it had none."""
    moved = np.full(now.shape, new, dtype=layer.dtype)
    steps = [round((now.origin[axis] - before.origin[axis]) / now.resolution) for axis in (1, 0)]
    kept = [_kept(step, cells) for step, cells in zip(steps, before.shape, strict=True)]
    target = tuple(slice(first - step, last - step) for (first, last), step in zip(kept, steps, strict=True))
    moved[target] = layer[tuple(slice(first, last) for first, last in kept)]
    return moved


def _kept(step: int, cells: int) -> tuple[int, int]:
    """The first and one past the last of so many cells in a row that are still among them after a step."""
    first = min(max(0, step), cells)
    return first, max(first, min(cells, cells + step))


def within(frame: Frame, start: Pose2, goal: Pose2) -> Pose2:
    """The goal itself; or, when it is beyond the window, the point of the straight way to it just inside."""
    if frame.covers(goal.x, goal.y):
        return goal
    across, up = frame.shape[1] * frame.resolution, frame.shape[0] * frame.resolution
    part = 1.0
    for here, there, low, size in (
        (start.x, goal.x, frame.origin[0], across),
        (start.y, goal.y, frame.origin[1], up),
    ):
        if there != here:
            edge = low + size - EDGE if there > here else low + EDGE
            part = min(part, max(0.0, (edge - here) / (there - here)))
    dx, dy = goal.x - start.x, goal.y - start.y
    return Pose2(start.x + part * dx, start.y + part * dy, math.atan2(dy, dx))
