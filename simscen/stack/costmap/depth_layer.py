"""Obstacles seen by a depth camera (Nav2's voxel layer, without voxels), and detection of sloping ground.

Each cell stores the height of the obstacle point. It is cleared when the camera sees through that point. Looking over
a low box or below a table top therefore clears neither.

In each image column, the ground is followed from the robot upward. Points that rise no steeper than the configured
slope are ground; steeper faces and edges are obstacles.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Image
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.grid_frame import Cells, GridFrame
from simscen.stack.costmap.static_layer import Mask

Heights = npt.NDArray[np.float32]


class DepthObservation(NamedTuple):
    """Content of a depth image: obstacle cells (n, 2), their heights (n,), and ground cells."""

    cells: Cells
    heights: Heights
    ground: Cells


def project_depth_image(
    image: Image, base: Pose2, frame: GridFrame, spec: CostmapSpec, known: Mask
) -> DepthObservation:
    """Return what the camera sees from a robot at `base`; `known` are cells already detected as ground."""
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
    return DepthObservation(
        cells[marked], heights.reshape(-1)[marked].astype(np.float32), cells[level.reshape(-1) & inside]
    )


def seen_through(
    cells: Cells, heights: Heights, frame: GridFrame, image: Image, base: Pose2, spec: CostmapSpec
) -> Mask:
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
    project_depth_image = image.depth[np.where(inside, row, 0), np.where(inside, column, 0)]
    with np.errstate(invalid="ignore"):
        through = inside & (project_depth_image > depth + frame.resolution) & (depth <= spec.raytrace_max_range)
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


Pixels = npt.NDArray[np.bool_]
GROUND_STEP_M = 0.05
"""Length of ground needed before the slope is measured from the new point."""
MAX_RISE_RATIO = 1.0
"""Rise per meter above which points belong to an upright face."""
SLOPE_ROWS_DIVISOR = 8
"""The part of a picture's rows that tells how what is seen first rises."""


def above_ground(away: Array, heights: Array, slope: float, low: float, known: Pixels) -> tuple[Array, Pixels]:
    """How high points (rows, columns) are above the ground, in meters, and which of them are ground.

    `away` are their distances along the plane from the camera, `heights` above the plane on which the robot stands,
    from the top row down; nan where nothing is seen. Ground rises by no more than the angle `slope`. What is seen
    first, lies higher by more than `low` than its own slope leads from the robot's feet, and is not `known` for ground,
    stands on a step that the picture does not show.
    """
    steepest, upright = math.tan(slope), _upright(away, heights)
    rows, columns = heights.shape
    far, ground = np.zeros(columns), np.zeros(columns)
    follows = ~_on_a_step(away, heights, upright, low) | known[_lowest(heights), np.arange(columns)]
    above, level = np.full(heights.shape, np.nan), np.zeros(heights.shape, dtype=bool)
    for row in range(rows - 1, -1, -1):
        r, z = away[row], heights[row]
        on = follows & (z - ground <= steepest * (r - far)) & ~upright[row]
        over = z - ground * np.minimum(1.0, r / np.maximum(far, GROUND_STEP_M))
        above[row], level[row] = np.where(on, np.minimum(over, 0.0), over), on
        on &= r - far >= GROUND_STEP_M
        far, ground = np.where(on, r, far), np.where(on, z, ground)
    return above, level


def _upright(away: Array, heights: Array) -> Pixels:
    """Which points are of a face: what is seen in the next row, or in the one before, is straight above or below."""
    steep: Pixels = np.diff(-heights, axis=0) > MAX_RISE_RATIO * np.maximum(np.diff(-away, axis=0), 0.0)
    upright = np.zeros(heights.shape, dtype=bool)
    upright[1:] = steep
    upright[:-1] |= steep
    return upright


def _on_a_step(away: Array, heights: Array, upright: Pixels, low: float) -> Pixels:
    """In which columns what is seen first is a face, or higher than the slope on which it lies can lead."""
    rows, columns = heights.shape
    every, first = np.arange(columns), _lowest(heights)
    then = np.maximum(first - rows // SLOPE_ROWS_DIVISOR, 0)
    r, z = away[first, every], heights[first, every]
    rise = (heights[then, every] - z) / np.maximum(away[then, every] - r, GROUND_STEP_M)
    step: Pixels = (z > low) & (upright[first, every] | ~(z - rise * r <= low))
    return step


def _lowest(heights: Array) -> npt.NDArray[np.intp]:
    """Return the lowest row of each column in which anything is seen, or the last row."""
    rows: npt.NDArray[np.intp] = len(heights) - 1 - np.isfinite(heights)[::-1].argmax(axis=0)
    return rows
