"""Obstacles that a depth camera sees above and below the plane of a lidar: Nav2's voxel layer, without its voxels.

A cell remembers at what height something was seen in it. It is cleared when the camera sees through that very point,
so that looking over a low box or under a table top clears neither.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Image
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.frame import Cells, Frame
from simscen.stack.costmap.ground import above_ground
from simscen.stack.costmap.static_layer import Mask

Heights = npt.NDArray[np.float32]


class Shown(NamedTuple):
    """What a picture shows: cells (n, 2) with something that is no ground, at what height (n,), and where ground is."""

    cells: Cells
    heights: Heights
    ground: Cells


def shown(image: Image, base: Pose2, frame: Frame, spec: CostmapSpec, known: Mask) -> Shown:
    """What the camera sees, from a robot at `base`; `known` are the cells that have been ground before."""
    across, up = _slopes(image.depth.shape, image.field_of_view)
    depth = image.depth.astype(np.float64)
    depth[~((depth <= spec.obstacle_max_range) & (depth > 0.0))] = np.nan
    points = image.mount.apply(np.stack((depth, depth * across, depth * up), axis=-1))
    away, heights = np.hypot(points[..., 0] - image.mount.x, points[..., 1] - image.mount.y), points[..., 2]
    cells = frame.cells(base.apply(np.nan_to_num(points[..., :2].reshape(-1, 2))))
    inside = frame.inside(cells) & np.isfinite(heights).reshape(-1)
    cells[~inside] = 0
    if spec.max_ground_slope > 0.0:
        before = (known[cells[:, 0], cells[:, 1]] & inside).reshape(heights.shape)
        above, level = above_ground(away, heights, spec.max_ground_slope, spec.min_obstacle_height, before)
    else:
        above, level = heights, np.zeros(heights.shape, dtype=bool)
    counts = (above >= spec.min_obstacle_height) & (above <= spec.max_obstacle_height)
    counts &= (away >= spec.obstacle_min_range) & (away <= spec.obstacle_max_range)
    marked = counts.reshape(-1) & inside
    return Shown(cells[marked], heights.reshape(-1)[marked].astype(np.float32), cells[level.reshape(-1) & inside])


def seen_through(cells: Cells, heights: Heights, frame: Frame, image: Image, base: Pose2, spec: CostmapSpec) -> Mask:
    """Which of the cells (n, 2) the camera looks through at their heights (n,), to something farther away."""
    place = base.inverse().apply(frame.centers(cells))
    seen = image.mount.inverse().apply(np.column_stack((place, heights.astype(np.float64))))
    ahead = seen[:, 0] > 0.0
    depth = np.where(ahead, seen[:, 0], 1.0)
    rows, columns = image.depth.shape
    focal = _focal(columns, image.field_of_view)
    column = np.floor(columns / 2 - focal * seen[:, 1] / depth).astype(np.int64)
    row = np.floor(rows / 2 - focal * seen[:, 2] / depth).astype(np.int64)
    inside = ahead & (row >= 0) & (column >= 0) & (row < rows) & (column < columns)
    shown = image.depth[np.where(inside, row, 0), np.where(inside, column, 0)]
    with np.errstate(invalid="ignore"):
        through = inside & (shown > depth + frame.resolution) & (depth <= spec.raytrace_max_range)
    return np.asarray(through)


def _focal(columns: int, field_of_view: float) -> float:
    """In pixels."""
    return columns / 2 / math.tan(field_of_view / 2)


@lru_cache(maxsize=8)
def _slopes(shape: tuple[int, int], field_of_view: float) -> tuple[Array, Array]:
    """For each pixel how far it looks to the left, and up, for each meter of depth."""
    rows, columns = shape
    focal = _focal(columns, field_of_view)
    left, up = (columns / 2 - 0.5 - np.arange(columns)) / focal, (rows / 2 - 0.5 - np.arange(rows)) / focal
    return np.broadcast_to(left, shape), np.broadcast_to(up[:, None], shape)
