"""Search of the gap that is too narrow for a robot: the narrowest point of the widest path between two places."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.shapes import TriangleMesh
from simscen.worlds.maps.occupancy_map import empty_grid
from simscen.worlds.routes.clearance import ClearanceField, clearance_field

MAX_CELLS = 1_000_000
MIN_CLEARANCE_CELLS = 0.71
"""Clearance below which a gap cannot be distinguished from a thin wall."""
SAME_THICKNESS_CELLS = 0.3
"""Difference up to which walls are equally thin; then the one nearest to the center between start and goal counts."""
OPPOSITE_COSINE = -0.5
"""Cosine of the angle beyond which two solids are on different sides of a gap."""


@dataclass(frozen=True)
class Gap:
    """Narrowest point of the widest path: its center, and `width` in m, 0 without any gap.

    `sides` are the points of the solids on both sides.
    """

    x: float
    y: float
    width: float
    sides: tuple[tuple[float, float], ...] = ()


def narrowest_gap(
    mesh: TriangleMesh,
    bounds: tuple[float, float, float, float],
    ends: tuple[Pose2, Pose2],
    radius: float,
    z_range: tuple[float, float],
) -> Gap:
    """Return the gap that stops a disc of `radius` m between two `ends`. Its width is exact to about 2 cm."""
    x0, y0, x1, y1 = bounds
    room = 2 * radius
    area = (x1 - x0 + 2 * room + 2) * (y1 - y0 + 2 * room + 2)
    grid = empty_grid((x0 - room, y0 - room, x1 + room, y1 + room), max(0.05, math.sqrt(area / MAX_CELLS)), "gap")
    return narrowest_gap_in(clearance_field(mesh, grid, z_range), ends, radius)


def narrowest_gap_in(field: ClearanceField, ends: tuple[Pose2, Pose2], radius: float) -> Gap:
    """Return the gap, as `narrowest_gap`, for a known clearance field."""
    grid = field.grid
    clearance = _clearances(field, 2 * radius)
    cell = _bottleneck(clearance, grid.cell_of(np.array([ends[0][:2], ends[1][:2]])))
    place: Array = grid.center_of(cell[None])[0]
    least = clearance[tuple(cell)]
    if least < MIN_CLEARANCE_CELLS * grid.resolution:
        return Gap(*_thinnest_wall(clearance, grid, ends), 0.0)
    return _measure_gap(field, place, 4 * radius)


def _clearances(field: ClearanceField, most: float) -> Array:
    """Return the clearance of each cell's center in m, negative in solids and at most `most`."""
    clearance: Array = np.minimum(field.rough, most)
    near = field.rough < most
    clearance[near] = np.minimum(field.exact(_centers(field.grid, near)), most)
    return clearance


def _centers(grid: OccupancyGrid, cells: npt.NDArray[np.bool_]) -> Array:
    return grid.center_of(np.argwhere(cells))


def _bottleneck(clearance: Array, ends: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the cell (row, column) with the least clearance on the path between two cells with the most clearance."""
    from scipy import ndimage

    first, last = (tuple(end) for end in ends)
    levels = np.unique(clearance)
    low, high = 0, len(levels)  # connected at levels[low], and at no level from levels[high] on
    while high - low > 1:
        middle = (low + high) // 2
        labels, _ = ndimage.label(clearance >= levels[middle], structure=np.ones((3, 3)))
        joined = labels[first] == labels[last] > 0
        low, high = (middle, high) if joined else (low, middle)
    return _connecting_cell(clearance, levels[low], first, last)


def _connecting_cell(
    clearance: Array, level: float, first: tuple[int, ...], last: tuple[int, ...]
) -> npt.NDArray[np.int64]:
    """Return a cell of this clearance that connects the start's region of greater clearance with another region."""
    from scipy import ndimage

    parts, _ = ndimage.label(clearance > level, structure=np.ones((3, 3)))
    joints, _ = ndimage.label(clearance == level, structure=np.ones((3, 3)))
    found: list[tuple[bool, npt.NDArray[np.int64]]] = []
    for number, box in enumerate(ndimage.find_objects(joints), start=1):
        around = tuple(slice(max(0, side.start - 1), side.stop + 1) for side in box)
        beside = ndimage.binary_dilation(joints[around] == number, structure=np.ones((3, 3), np.bool_))
        joined = set(np.unique(parts[around][beside]).tolist()) - {0}
        cells = np.argwhere(joints == number)
        if len(joined) > 1 and (parts[first] in joined or parts[first] == 0):
            found.append((parts[last] not in joined, cells[len(cells) // 2]))
    cell: npt.NDArray[np.int64] = min(found, key=lambda joint: joint[0])[1] if found else np.argwhere(joints)[0]
    return cell


def _thinnest_wall(clearance: Array, grid: OccupancyGrid, ends: tuple[Pose2, Pose2]) -> tuple[float, float]:
    """Return the center of the thinnest wall between the regions of both ends.

    Thinner walls elsewhere do not count, because a path through them would cross two walls.
    """
    from scipy import ndimage

    places = np.array([end[:2] for end in ends])
    walls = clearance < MIN_CLEARANCE_CELLS * grid.resolution
    parts, _ = ndimage.label(~walls, structure=np.ones((3, 3)))
    away: list[Array] = []
    for row, column in grid.cell_of(places).tolist():
        part = parts == parts[row, column] if parts[row, column] else np.zeros_like(walls)
        part[row, column] = True
        away.append(ndimage.distance_transform_edt(~part))
    depth = np.where(walls, np.maximum(*away), np.inf)
    middles = grid.center_of(np.argwhere(depth < depth.min() + SAME_THICKNESS_CELLS))
    x, y = middles[np.argmin(np.linalg.norm(middles - places.mean(axis=0), axis=1))].tolist()
    return x, y


def _measure_gap(field: ClearanceField, place: Array, reach: float) -> Gap:
    """Return the gap at a place, between the two points of solids on opposite sides that are nearest to each other."""
    assert field.outline is not None
    points = field.outline.data[field.outline.query_ball_point(place, reach)]
    apart = points - place
    distances = np.linalg.norm(apart, axis=1)
    towards = apart[int(np.argmin(distances))] / distances.min()
    cosines = (apart @ towards) / distances
    near, far = points[cosines > -OPPOSITE_COSINE], points[cosines < OPPOSITE_COSINE]
    if not len(far):
        return Gap(float(place[0]), float(place[1]), 2 * float(distances.min()))
    between = np.linalg.norm(near[:, None] - far[None], axis=2)
    j, k = np.unravel_index(int(np.argmin(between)), between.shape)
    (ax, ay), (bx, by) = near[j].tolist(), far[k].tolist()
    return Gap((ax + bx) / 2, (ay + by) / 2, float(between[j, k]), ((ax, ay), (bx, by)))
