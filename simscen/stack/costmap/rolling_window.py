"""Rolling window of a costmap: when and where it moves with the robot, and what remains of its layers."""

import math
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2
from simscen.stack.costmap.grid_frame import GridFrame

ValueType = TypeVar("ValueType", bound=np.generic)

GOAL_EDGE_MARGIN_M = 0.6
"""Distance from the edge of the window at which a plan ends if the goal is outside."""
ROLL_RATIO = 1 / 8
"""A window is moved when the robot is farther from the window's center than this fraction of its size."""
MAX_ROLL_OFFSET_M = 0.25
"""The window of a local costmap is moved when the robot is farther than this from the window's center."""


def window_around(center: Pose2, size: tuple[float, float], resolution: float) -> GridFrame:
    """Return a window of `size` (x, y) in m around a pose. Cells of different windows align."""
    columns, rows = (math.ceil(length / resolution) for length in size)
    column, row = round(center.x / resolution) - columns // 2, round(center.y / resolution) - rows // 2
    return GridFrame((column * resolution, row * resolution), resolution, (rows, columns))


def should_roll(frame: GridFrame, base: Pose2, max_offset: float = math.inf) -> bool:
    """Return whether the robot is farther from the center than ROLL_RATIO of the size, or than `max_offset` m."""
    rows, columns = frame.shape
    across, up = columns * frame.resolution, rows * frame.resolution
    offset = abs(base.x - frame.origin[0] - across / 2), abs(base.y - frame.origin[1] - up / 2)
    return offset[0] > min(ROLL_RATIO * across, max_offset) or offset[1] > min(ROLL_RATIO * up, max_offset)


def shift_layer(
    layer: npt.NDArray[ValueType], before: GridFrame, after: GridFrame, fill: float
) -> npt.NDArray[ValueType]:
    """Return a copy of the layer for another window of the same size. New cells get the value `fill`."""
    shifted = np.full(after.shape, fill, dtype=layer.dtype)
    steps = [round((after.origin[axis] - before.origin[axis]) / after.resolution) for axis in (1, 0)]
    remaining = [_remaining(step, cells) for step, cells in zip(steps, before.shape, strict=True)]
    target = tuple(slice(first - step, last - step) for (first, last), step in zip(remaining, steps, strict=True))
    shifted[target] = layer[tuple(slice(first, last) for first, last in remaining)]
    return shifted


def _remaining(step: int, cells: int) -> tuple[int, int]:
    """Return the range (first, end) of cells along an axis that remain in the window after a shift by `step` cells."""
    first = min(max(0, step), cells)
    return first, max(first, min(cells, cells + step))


def clip_goal(frame: GridFrame, start: Pose2, goal: Pose2) -> Pose2:
    """Return the goal. If it is outside the window, return a pose inside, on the line from start to goal."""
    if frame.covers(goal.x, goal.y):
        return goal
    across, up = frame.shape[1] * frame.resolution, frame.shape[0] * frame.resolution
    fraction = 1.0
    for start_coordinate, goal_coordinate, low, size in (
        (start.x, goal.x, frame.origin[0], across),
        (start.y, goal.y, frame.origin[1], up),
    ):
        if goal_coordinate != start_coordinate:
            edge = low + size - GOAL_EDGE_MARGIN_M if goal_coordinate > start_coordinate else low + GOAL_EDGE_MARGIN_M
            fraction = min(fraction, max(0.0, (edge - start_coordinate) / (goal_coordinate - start_coordinate)))
    dx, dy = goal.x - start.x, goal.y - start.y
    return Pose2(start.x + fraction * dx, start.y + fraction * dy, math.atan2(dy, dx))
