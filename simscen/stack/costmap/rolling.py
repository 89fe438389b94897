"""The window that a robot without a map carries around: obstacles in it persist, what leaves it is forgotten."""

import math

import numpy as np

from simscen.core.geometry import Pose2
from simscen.stack.costmap.frame import Frame
from simscen.stack.costmap.static_layer import Mask

EDGE = 0.6
"""Metres inside the window's edge where a goal beyond it is aimed at."""
FOLLOW = 1 / 8
"""The window is moved when the robot is this part of its size away from its middle."""


def window_around(centre: Pose2, size: float, resolution: float) -> Frame:
    """A square window of edge `size` metres around a point; its cells are always the same ones of the plane."""
    cells = math.ceil(size / resolution)
    column, row = round(centre.x / resolution) - cells // 2, round(centre.y / resolution) - cells // 2
    return Frame((column * resolution, row * resolution), resolution, (cells, cells))


def left_behind(frame: Frame, base: Pose2) -> bool:
    """Whether the robot has come so far from the middle that the window should follow."""
    size = frame.shape[0] * frame.resolution
    middle = (frame.origin[0] + size / 2, frame.origin[1] + size / 2)
    return max(abs(base.x - middle[0]), abs(base.y - middle[1])) > FOLLOW * size


def carried_over(marks: Mask, before: Frame, now: Frame) -> Mask:
    """The marks of a window in the window after it."""
    moved = np.zeros(now.shape, dtype=bool)
    cells = now.cells(before.centres(np.argwhere(marks)))
    cells = cells[now.inside(cells)]
    moved[cells[:, 0], cells[:, 1]] = True
    return moved


def within(frame: Frame, start: Pose2, goal: Pose2) -> Pose2:
    """The goal itself; or, when it is beyond the window, the point of the straight way to it just inside."""
    if frame.covers(goal.x, goal.y):
        return goal
    size = frame.shape[0] * frame.resolution
    part = 1.0
    for here, there, low in ((start.x, goal.x, frame.origin[0]), (start.y, goal.y, frame.origin[1])):
        if there != here:
            edge = low + size - EDGE if there > here else low + EDGE
            part = min(part, max(0.0, (edge - here) / (there - here)))
    dx, dy = goal.x - start.x, goal.y - start.y
    return Pose2(start.x + part * dx, start.y + part * dy, math.atan2(dy, dx))
