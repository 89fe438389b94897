"""Find the gap that is too narrow for a robot: the narrowest point of the widest path between two positions.

The widest path is the path whose narrowest point is as wide as possible.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.worlds.routes.clearance import ClearanceField

MIN_CLEARANCE_CELLS = 0.71
"""Clearance below which a gap cannot be distinguished from a thin wall: half of the diagonal of a cell."""
SAME_THICKNESS_CELLS = 0.3
"""Difference below which walls count as equally thin. Of these, the wall nearest to the midpoint of the ends counts."""
OPPOSITE_COSINE = -0.5
"""Cosine of the minimum angle (120°), seen from the gap, between the nearest point and points on the other side."""


@dataclass(frozen=True)
class Gap:
    """Narrowest point of the widest path between two positions.

    x, y:   center in m
    width:  width in m; 0 if every path leads through a wall (the center is then in the thinnest wall)
    sides:  nearest points of the solids on both sides; () for a wall, or if there is a solid on one side only
    """

    x: float
    y: float
    width: float
    sides: tuple[tuple[float, float], ...] = ()


def narrowest_gap(field: ClearanceField, ends: tuple[Pose2, Pose2], radius: float) -> Gap:
    """Return the gap that blocks a disc of `radius` m on its way between the two positions `ends`.

    The width of the gap is exact to about 2 cm.
    """
    grid = field.grid
    clearance: Array = np.minimum(field.cell_clearance, 2 * radius)
    is_near = field.cell_clearance < 2 * radius
    clearance[is_near] = np.minimum(field.clearance_at(grid.center_of(np.argwhere(is_near))), 2 * radius)
    cell = _bottleneck(clearance, grid.cell_of(np.array([ends[0][:2], ends[1][:2]])))
    position: Array = grid.center_of(cell[None])[0]
    min_clearance = clearance[tuple(cell)]
    if min_clearance < MIN_CLEARANCE_CELLS * grid.resolution:
        return Gap(*_thinnest_wall(clearance, grid, ends), 0.0)
    return _measure_gap(field, position, 4 * radius)


def _bottleneck(clearance: Array, ends: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the cell (row, column) with the least clearance on the widest path between two cells.

    `clearance` (rows, columns) is in m. `ends` (2, 2) are the two cells as (row, column). The search is a bisection of
    the clearance.
    """
    from scipy import ndimage

    first, last = (tuple(end) for end in ends)
    levels = np.unique(clearance)
    low, high = 0, len(levels)  # connected at levels[low], and at no level from levels[high] on
    while high - low > 1:
        middle = (low + high) // 2
        labels, _ = ndimage.label(clearance >= levels[middle], structure=np.ones((3, 3)))
        is_connected = labels[first] == labels[last] > 0
        low, high = (middle, high) if is_connected else (low, middle)
    return _connecting_cell(clearance, levels[low], first, last)


def _connecting_cell(
    clearance: Array, level: float, first: tuple[int, ...], last: tuple[int, ...]
) -> npt.NDArray[np.int64]:
    """Return a cell with the clearance `level` that connects two regions of greater clearance.

    If possible, one region contains the cell `first`, and the other one `last`. All cells are (row, column).
    """
    from scipy import ndimage

    parts, _ = ndimage.label(clearance > level, structure=np.ones((3, 3)))
    joints, _ = ndimage.label(clearance == level, structure=np.ones((3, 3)))
    found: list[tuple[bool, npt.NDArray[np.int64]]] = []
    for number, box in enumerate(ndimage.find_objects(joints), start=1):
        around = tuple(slice(max(0, side.start - 1), side.stop + 1) for side in box)
        neighbors = ndimage.binary_dilation(joints[around] == number, structure=np.ones((3, 3), np.bool_))
        connected = set(np.unique(parts[around][neighbors]).tolist()) - {0}
        cells = np.argwhere(joints == number)
        if len(connected) > 1 and (parts[first] in connected or parts[first] == 0):
            found.append((parts[last] not in connected, cells[len(cells) // 2]))
    cell: npt.NDArray[np.int64] = min(found, key=lambda joint: joint[0])[1] if found else np.argwhere(joints)[0]
    return cell


def _thinnest_wall(clearance: Array, grid: OccupancyGrid, ends: tuple[Pose2, Pose2]) -> tuple[float, float]:
    """Return the center (x, y) of the thinnest wall between the regions that contain the two ends."""
    from scipy import ndimage

    points = np.array([end[:2] for end in ends])
    walls = clearance < MIN_CLEARANCE_CELLS * grid.resolution
    parts, _ = ndimage.label(~walls, structure=np.ones((3, 3)))
    distances: list[Array] = []
    for row, column in grid.cell_of(points).tolist():
        part = parts == parts[row, column] if parts[row, column] else np.zeros_like(walls)
        part[row, column] = True
        distances.append(ndimage.distance_transform_edt(~part))
    depth = np.where(walls, np.maximum(*distances), np.inf)
    middles = grid.center_of(np.argwhere(depth < depth.min() + SAME_THICKNESS_CELLS))
    x, y = middles[np.argmin(np.linalg.norm(middles - points.mean(axis=0), axis=1))].tolist()
    return x, y


def _measure_gap(field: ClearanceField, position: Array, search_radius: float) -> Gap:
    """Return the gap at a position (2,), between the two nearest points of solids on opposite sides.

    Only points within `search_radius` m of the position are considered.
    """
    assert field.outline is not None
    points = field.outline.data[field.outline.query_ball_point(position, search_radius)]
    offsets = points - position
    distances = np.linalg.norm(offsets, axis=1)
    direction = offsets[int(np.argmin(distances))] / distances.min()
    cosines = (offsets @ direction) / distances
    near, far = points[cosines > -OPPOSITE_COSINE], points[cosines < OPPOSITE_COSINE]
    if not len(far):
        return Gap(float(position[0]), float(position[1]), 2 * float(distances.min()))
    between = np.linalg.norm(near[:, None] - far[None], axis=2)
    j, k = np.unravel_index(int(np.argmin(between)), between.shape)
    (ax, ay), (bx, by) = near[j].tolist(), far[k].tolist()
    return Gap((ax + bx) / 2, (ay + by) / 2, float(between[j, k]), ((ax, ay), (bx, by)))
