"""Obstacles and ground seen by a depth camera (like Nav2's voxel layer, but without voxels).

Each obstacle cell stores the height of the observed point. A cell is cleared only when the camera sees through the
observed point, not when the camera looks over a low box or below a table top.

Ground can be sloping. Each image column is traced from the lowest row upward. Points that rise no more steeply than
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
"""Heights in m above the plane on which the robot stands."""


class DepthObservation(NamedTuple):
    """Content of a depth image: obstacle cells (n, 2), heights (n,) of the obstacles in m, and ground cells (m, 2)."""

    cells: Cells
    heights: Heights
    ground: Cells


def project_depth_image(
    image: Image, base: Pose2, frame: GridFrame, spec: CostmapSpec, known_ground: Mask
) -> DepthObservation:
    """Return the obstacles and the ground in an image that a robot at `base` has taken.

    `known_ground` (rows, columns) marks the cells that earlier images have shown as ground.
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
        ground_heights, is_ground = heights_above_ground(
            distances, heights, spec.max_ground_slope, spec.min_obstacle_height, was_ground
        )
    else:
        ground_heights, is_ground = heights, np.zeros(heights.shape, dtype=bool)
    is_obstacle = (ground_heights >= spec.min_obstacle_height) & (ground_heights <= spec.max_obstacle_height)
    is_obstacle &= (distances >= spec.obstacle_min_range) & (distances <= spec.obstacle_max_range)
    marked = is_obstacle.reshape(-1) & inside
    return DepthObservation(
        cells[marked], heights.reshape(-1)[marked].astype(np.float32), cells[is_ground.reshape(-1) & inside]
    )


def is_seen_through(
    cells: Cells, heights: Heights, frame: GridFrame, image: Image, base: Pose2, spec: CostmapSpec
) -> Mask:
    """Return which of the obstacle cells (n, 2) the camera sees through, because it measures a point farther away.

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
        is_through = inside & (measured > depth + frame.resolution) & (depth <= spec.raytrace_max_range)
    return np.asarray(is_through)


def _focal_length(columns: int, field_of_view: float) -> float:
    """Return the focal length in pixels of an image with this number of columns. `field_of_view` is in rad."""
    return columns / 2 / math.tan(field_of_view / 2)


@lru_cache(maxsize=8)
def _ray_slopes(shape: tuple[int, int], field_of_view: float) -> tuple[Array, Array]:
    """Return the slopes (rows, columns) of the rays of all pixels: m to the left per m of depth, and m up per m."""
    rows, columns = shape
    focal = _focal_length(columns, field_of_view)
    left, up = (columns / 2 - 0.5 - np.arange(columns)) / focal, (rows / 2 - 0.5 - np.arange(rows)) / focal
    return np.broadcast_to(left, shape), np.broadcast_to(up[:, None], shape)


GROUND_STEP_M = 0.05
"""Minimum horizontal distance between two points of a column from which a ground slope is computed."""
MAX_RISE_RATIO = 1.0
"""Rise in m per m above which two points belong to an upright face."""
SLOPE_ROWS_DIVISOR = 8
"""The ground slope at the lowest point of a column is measured over this fraction (1 / 8) of the image rows."""


def heights_above_ground(
    distances: Array, heights: Array, max_slope: float, max_step: float, known_ground: Mask
) -> tuple[Array, Mask]:
    """Return for each pixel (rows, columns) the height in m above the ground, and whether it shows the ground.

    distances:     horizontal distance of each point from the camera in m, top row first
    heights:       height in m above the plane on which the robot stands; nan for pixels without a point
    max_slope:     maximum slope angle of the ground in rad
    max_step:      height in m up to which the lowest point of a column counts as ground
    known_ground:  whether each point is in a cell that earlier images have shown as ground
    """
    max_rise, upright = math.tan(max_slope), _is_upright(distances, heights)
    rows, columns = heights.shape
    ground_distance, ground_height = np.zeros(columns), np.zeros(columns)
    is_step = _starts_on_step(distances, heights, upright, max_step)
    has_ground = ~is_step | known_ground[_lowest_rows(heights), np.arange(columns)]
    heights_above, is_ground = np.full(heights.shape, np.nan), np.zeros(heights.shape, dtype=bool)
    for row in range(rows - 1, -1, -1):
        r, z = distances[row], heights[row]
        is_ground_here = has_ground & (z - ground_height <= max_rise * (r - ground_distance)) & ~upright[row]
        height = z - ground_height * np.minimum(1.0, r / np.maximum(ground_distance, GROUND_STEP_M))
        heights_above[row] = np.where(is_ground_here, np.minimum(height, 0.0), height)
        is_ground[row] = is_ground_here
        is_ground_here &= r - ground_distance >= GROUND_STEP_M
        ground_distance = np.where(is_ground_here, r, ground_distance)
        ground_height = np.where(is_ground_here, z, ground_height)
    return heights_above, is_ground


def _is_upright(distances: Array, heights: Array) -> Mask:
    """Return which points are on an upright face: they are steeply above or below the point in an adjacent row."""
    steep: Mask = np.diff(-heights, axis=0) > MAX_RISE_RATIO * np.maximum(np.diff(-distances, axis=0), 0.0)
    upright = np.zeros(heights.shape, dtype=bool)
    upright[1:] = steep
    upright[:-1] |= steep
    return upright


def _starts_on_step(distances: Array, heights: Array, upright: Mask, max_step: float) -> Mask:
    """Return in which columns the lowest point is on a step or an obstacle that begins below the image.

    The lowest point is on a step if it is higher than `max_step`, and if it is on an upright face or if the slope at
    this point, extrapolated back to the camera, does not fall to `max_step`.
    """
    rows, columns = heights.shape
    all_columns, lowest = np.arange(columns), _lowest_rows(heights)
    upper = np.maximum(lowest - rows // SLOPE_ROWS_DIVISOR, 0)
    r, z = distances[lowest, all_columns], heights[lowest, all_columns]
    rise = (heights[upper, all_columns] - z) / np.maximum(distances[upper, all_columns] - r, GROUND_STEP_M)
    step: Mask = (z > max_step) & (upright[lowest, all_columns] | ~(z - rise * r <= max_step))
    return step


def _lowest_rows(heights: Array) -> npt.NDArray[np.intp]:
    """Return for each column the lowest row with a point; the last row for columns without a point."""
    rows: npt.NDArray[np.intp] = len(heights) - 1 - np.isfinite(heights)[::-1].argmax(axis=0)
    return rows
