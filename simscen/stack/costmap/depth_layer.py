"""Obstacles and ground seen by a depth camera (like Nav2's voxel layer, but without voxels).

Each obstacle cell stores the height of the observed point. The cell is cleared only when the camera sees through that
point, not when it looks over a low box or below a table top.

Ground can be sloping. Each image column is traced from its lowest row upward. Points that rise no more steeply than
`max_ground_slope` are ground. Steeper faces are obstacles.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Image
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.grid_frame import Cells, GridFrame, Mask

Heights = npt.NDArray[np.float32]


class DepthObservation(NamedTuple):
    """Content of a depth image: obstacle cells (n, 2), their heights (n,) in m, and ground cells (m, 2)."""

    cells: Cells
    heights: Heights
    ground: Cells


def project_depth_image(
    image: Image, base: Pose2, frame: GridFrame, spec: CostmapSpec, known_ground: Mask
) -> DepthObservation:
    """Return the obstacles and the ground in an image that a robot at `base` has taken.

    `known_ground` (rows, columns) are the cells that earlier images showed as ground.
    """
    across, up = _ray_slopes(image.depth.shape, image.field_of_view)
    depth = image.depth.astype(np.float64)
    depth[~((depth <= spec.obstacle_max_range) & (depth > 0.0))] = np.nan
    points = image.mount.apply(np.stack((depth, depth * across, depth * up), axis=-1))
    distances, heights = np.hypot(points[..., 0] - image.mount.x, points[..., 1] - image.mount.y), points[..., 2]
    cells = frame.cells(base.apply(np.nan_to_num(points[..., :2].reshape(-1, 2))))
    inside = frame.inside(cells) & np.isfinite(heights).reshape(-1)
    cells[~inside] = 0
    if spec.max_ground_slope > 0.0:
        was_ground = (known_ground[cells[:, 0], cells[:, 1]] & inside).reshape(heights.shape)
        above, level = heights_above_ground(
            distances, heights, spec.max_ground_slope, spec.min_obstacle_height, was_ground
        )
    else:
        above, level = heights, np.zeros(heights.shape, dtype=bool)
    is_obstacle = (above >= spec.min_obstacle_height) & (above <= spec.max_obstacle_height)
    is_obstacle &= (distances >= spec.obstacle_min_range) & (distances <= spec.obstacle_max_range)
    marked = is_obstacle.reshape(-1) & inside
    return DepthObservation(
        cells[marked], heights.reshape(-1)[marked].astype(np.float32), cells[level.reshape(-1) & inside]
    )


def is_seen_through(
    cells: Cells, heights: Heights, frame: GridFrame, image: Image, base: Pose2, spec: CostmapSpec
) -> Mask:
    """Return which of the obstacle cells (n, 2) the camera sees through: it measures a point farther away.

    `heights` (n,) are the heights of the obstacles in m.
    """
    in_base = base.inverse().apply(frame.centers(cells))
    points = image.mount.inverse().apply(np.column_stack((in_base, heights.astype(np.float64))))
    is_ahead = points[:, 0] > 0.0
    depth = np.where(is_ahead, points[:, 0], 1.0)
    rows, columns = image.depth.shape
    focal = _focal_length(columns, image.field_of_view)
    column = np.floor(columns / 2 - focal * points[:, 1] / depth).astype(np.int64)
    row = np.floor(rows / 2 - focal * points[:, 2] / depth).astype(np.int64)
    inside = is_ahead & (row >= 0) & (column >= 0) & (row < rows) & (column < columns)
    measured = image.depth[np.where(inside, row, 0), np.where(inside, column, 0)]
    with np.errstate(invalid="ignore"):
        through = inside & (measured > depth + frame.resolution) & (depth <= spec.raytrace_max_range)
    return np.asarray(through)


def _focal_length(columns: int, field_of_view: float) -> float:
    """Return the focal length in pixels."""
    return columns / 2 / math.tan(field_of_view / 2)


@lru_cache(maxsize=8)
def _ray_slopes(shape: tuple[int, int], field_of_view: float) -> tuple[Array, Array]:
    """Return the slopes of the ray of each pixel (rows, columns): m to the left, and m up, per m of depth."""
    rows, columns = shape
    focal = _focal_length(columns, field_of_view)
    left, up = (columns / 2 - 0.5 - np.arange(columns)) / focal, (rows / 2 - 0.5 - np.arange(rows)) / focal
    return np.broadcast_to(left, shape), np.broadcast_to(up[:, None], shape)


GROUND_STEP_M = 0.05
"""Minimum horizontal distance between two points of a column from which a ground slope is computed."""
MAX_RISE_RATIO = 1.0
"""Rise in m per m above which points belong to an upright face."""
SLOPE_ROWS_DIVISOR = 8
"""The slope at the lowest point of a column is measured over one eighth of the image rows."""


def heights_above_ground(
    distances: Array, heights: Array, max_slope: float, max_step: float, known_ground: Mask
) -> tuple[Array, Mask]:
    """Return the heights in m above the ground of the points of an image (rows, columns), and which points are ground.

    distances:     horizontal distances of the points from the camera in m, top row first
    heights:       heights in m above the plane on which the robot stands; nan for pixels without a point
    max_slope:     maximum slope angle of the ground in rad
    max_step:      height in m up to which the lowest point of a column counts as ground
    known_ground:  which points are on cells that earlier images showed as ground
    """
    max_rise, upright = math.tan(max_slope), _is_upright(distances, heights)
    rows, columns = heights.shape
    ground_distance, ground_height = np.zeros(columns), np.zeros(columns)
    is_step = _starts_on_step(distances, heights, upright, max_step)
    has_ground = ~is_step | known_ground[_lowest_rows(heights), np.arange(columns)]
    above, level = np.full(heights.shape, np.nan), np.zeros(heights.shape, dtype=bool)
    for row in range(rows - 1, -1, -1):
        r, z = distances[row], heights[row]
        is_ground = has_ground & (z - ground_height <= max_rise * (r - ground_distance)) & ~upright[row]
        height = z - ground_height * np.minimum(1.0, r / np.maximum(ground_distance, GROUND_STEP_M))
        above[row], level[row] = np.where(is_ground, np.minimum(height, 0.0), height), is_ground
        is_ground &= r - ground_distance >= GROUND_STEP_M
        ground_distance = np.where(is_ground, r, ground_distance)
        ground_height = np.where(is_ground, z, ground_height)
    return above, level


def _is_upright(distances: Array, heights: Array) -> Mask:
    """Return which points are on an upright face: steeply above or below the point in an adjacent row."""
    steep: Mask = np.diff(-heights, axis=0) > MAX_RISE_RATIO * np.maximum(np.diff(-distances, axis=0), 0.0)
    upright = np.zeros(heights.shape, dtype=bool)
    upright[1:] = steep
    upright[:-1] |= steep
    return upright


def _starts_on_step(distances: Array, heights: Array, upright: Mask, max_step: float) -> Mask:
    """Return in which columns the lowest point is on a step (or an obstacle) whose edge is below the image.

    Such a point is higher than `max_step`, and one of two conditions holds: it is on an upright face, or the slope
    there, extended to the robot, ends higher than `max_step`.
    """
    rows, columns = heights.shape
    all_columns, lowest = np.arange(columns), _lowest_rows(heights)
    upper = np.maximum(lowest - rows // SLOPE_ROWS_DIVISOR, 0)
    r, z = distances[lowest, all_columns], heights[lowest, all_columns]
    rise = (heights[upper, all_columns] - z) / np.maximum(distances[upper, all_columns] - r, GROUND_STEP_M)
    step: Mask = (z > max_step) & (upright[lowest, all_columns] | ~(z - rise * r <= max_step))
    return step


def _lowest_rows(heights: Array) -> npt.NDArray[np.intp]:
    """Return the lowest row with a point for each column; the last row for columns without a point."""
    rows: npt.NDArray[np.intp] = len(heights) - 1 - np.isfinite(heights)[::-1].argmax(axis=0)
    return rows
