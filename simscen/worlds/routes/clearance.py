"""Distance field to the nearest static solid, exact where it decides, and overlap tests for footprints."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Array
from simscen.core.geometry.polygons import polygon_contains
from simscen.core.geometry.shapes import Solid, TriangleMesh
from simscen.worlds.geometry.cross_section import Section, section, winds_about
from simscen.worlds.geometry.triangulation import fuse
from simscen.worlds.maps.rasterization import Cells, filled, ranges, touched

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

MOST_LEVELS = 12
"""Cuts through the robot's height; walls and boxes need one, whatever their number."""
SPACING = 0.02
"""Meters between the points that stand for an outline: at 0.2 m, half of it away errs by 0.25 mm."""
NOTHING = 1e6
"""The clearance in meters where there is no solid at all."""
HALF_DIAGONAL = 0.7072
"""Of a cell, in cells: how far anything in it may be from its middle."""


@dataclass(frozen=True, eq=False)
class ClearanceField:
    """The distance to the nearest solid, roughly for cells and exactly for points; negative inside of solids.

    `rough` (rows, columns) are meters from the middle of a cell to that of the nearest cell that a solid reaches into:
    the truth is at most HALF_DIAGONAL cells away from it. `inside` are the cells whose middle is in a solid. Point k of
    the outline is on the solid `names[owners[k]]`.
    """

    grid: OccupancyGrid
    rough: Array
    inside: Cells
    outline: "cKDTree | None"
    owners: npt.NDArray[np.int32]
    names: tuple[str, ...] = ()

    def exact(self, points: Array) -> Array:
        """Clearance (n,) in meters at points (n, 2)."""
        return self._nearest(points)[0]

    def keeps(self, points: Array, distance: float) -> npt.NDArray[np.bool_]:
        """Which of the points (n, 2) are at least `distance` meters away from every solid."""
        rough = self.rough[self._cells(points)]
        # Twice, as the point may be as far from the middle of its cell as the outline from that of its own.
        answer: npt.NDArray[np.bool_] = rough >= distance + 2 * HALF_DIAGONAL * self.grid.resolution
        unsure = ~answer
        answer[unsure] = self.exact(points[unsure]) >= distance
        return answer

    def free_cells(self, distance: float) -> Cells:
        """The cells whose middle is at least `distance` meters away from every solid."""
        slack = HALF_DIAGONAL * self.grid.resolution
        free: Cells = (self.rough >= distance + slack) & ~self.inside
        unsure = (np.abs(self.rough - distance) < slack) & ~self.inside
        free[unsure] = self.exact(self.grid.center_of(np.argwhere(unsure))) >= distance
        return free

    def push(self, points: Array, distance: float) -> Array:
        """How to move each of the points (n, 2) away from the solid nearest to it, to be `distance` meters off."""
        moves = np.zeros_like(points)
        near = self.rough[self._cells(points)] < distance + 2 * HALF_DIAGONAL * self.grid.resolution
        clearance, away = self._nearest(points[near])
        moves[near] = np.maximum(distance - clearance, 0.0)[:, None] * away
        return moves

    def _nearest(self, points: Array) -> tuple[Array, Array]:
        """Clearance (n,) and the unit direction (n, 2) in which it grows."""
        if self.outline is None:
            return np.full(len(points), NOTHING), np.zeros_like(points)
        distances, numbers = self.outline.query(points)
        sign = np.where(self.inside[self._cells(points)], -1.0, 1.0)
        apart = points - self.outline.data[numbers]
        return sign * distances, apart * (sign / np.where(distances > 0, distances, 1.0))[:, None]

    def _cells(self, points: Array) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        rows, columns = self.grid.cell_of(points).T
        return np.clip(rows, 0, self.grid.shape[0] - 1), np.clip(columns, 0, self.grid.shape[1] - 1)


def clearance_field(mesh: TriangleMesh, grid: OccupancyGrid, z_range: tuple[float, float]) -> ClearanceField:
    """The clearance from what `mesh` has between two heights; `grid` (without yaw) gives the lattice."""
    from scipy import ndimage, spatial

    cuts = standing_outlines(mesh, z_range)
    blocked, inside = np.zeros(grid.shape, np.bool_), np.zeros(grid.shape, np.bool_)
    for cut in cuts:
        local = Section((cut.segments - (grid.origin.x, grid.origin.y)) / grid.resolution, cut.owners)
        blocked |= touched(local, grid.shape)
        inside |= filled(local, grid.shape)
    samples, owners = _along(*(np.concatenate([getattr(cut, part) for cut in cuts]) for part in ("segments", "owners")))
    if not blocked.any():
        return ClearanceField(grid, np.full(grid.shape, NOTHING), inside, None, owners)
    rough = ndimage.distance_transform_edt(~blocked) * grid.resolution
    return ClearanceField(grid, rough, inside, spatial.cKDTree(samples), owners, mesh.names)


def standing_outlines(mesh: TriangleMesh, z_range: tuple[float, float]) -> list[Section]:
    """Cuts between two heights that show every upright wall and box there, and round things at MOST_LEVELS."""
    low, high = z_range
    z = np.unique(np.round(mesh.vertices[:, 2], 3))
    levels = np.concatenate(([low], z[(z > low) & (z < high)], [high]))
    middles = (levels[:-1] + levels[1:]) / 2
    if len(middles) > MOST_LEVELS:
        middles = np.linspace(low, high, MOST_LEVELS + 2)[1:-1]
    return [section(mesh, height) for height in middles.tolist()]


def _along(segments: Array, owners: npt.NDArray[np.int32]) -> tuple[Array, npt.NDArray[np.int32]]:
    """Points (n, 2) along segments (m, 2, 2), at most SPACING apart, ends included; the same point only once.

    With them the owner (n,) of each, given those (m,) of the segments.
    """
    step = segments[:, 1] - segments[:, 0]
    pieces = np.maximum(np.ceil(np.linalg.norm(step, axis=1) / SPACING), 1).astype(np.int64)
    which, number = ranges(np.zeros_like(pieces), pieces + 1)
    points = segments[which, 0] + (number / pieces[which])[:, None] * step[which]
    keys: npt.NDArray[np.int64] = np.round(points / (SPACING / 20)).astype(np.int64)
    order = np.lexsort(keys.T)
    new = np.ones(len(order), dtype=np.bool_)
    new[1:] = np.any(np.diff(keys[order], axis=0) != 0, axis=1)
    distinct: Array = points[order[new]]
    return distinct, owners[which][order[new]]


def cut_overlaps(solid: Solid, corners: Polygon, z_range: tuple[float, float]) -> bool:
    """Whether an outline shares inner points with the cuts of a solid between two heights."""
    return any(_shares(cut.segments, corners) for cut in standing_outlines(fuse([solid]), z_range))


def _shares(segments: Array, corners: Polygon) -> bool:
    if not len(segments):
        return False
    if winds_about(segments, corners[0]):
        return True
    ends = (*corners[1:], corners[0])
    if any(_cross(segments, np.array(a), np.array(b)) for a, b in zip(corners, ends, strict=True)):
        return True
    return _some_inside(segments, corners)


def _some_inside(segments: Array, corners: Polygon) -> bool:
    """Whether a segment begins inside; the outline of a small thing may lie within the footprint as a whole."""
    (left, low), (right, high) = np.min(corners, axis=0), np.max(corners, axis=0)
    x, y = segments[:, 0].T
    near = segments[(x >= left) & (x <= right) & (y >= low) & (y <= high), 0]
    return any(polygon_contains(corners, (px, py)) for px, py in near.tolist())


def _cross(segments: Array, a: Array, b: Array) -> bool:
    """Whether any of the segments (n, 2, 2) properly crosses the one from a to b."""
    way, along = b - a, segments[:, 1] - segments[:, 0]
    side = way[0] * (segments[:, :, 1] - a[1]) - way[1] * (segments[:, :, 0] - a[0])
    from_start, from_end = a - segments[:, 0], b - segments[:, 0]
    first = along[:, 0] * from_start[:, 1] - along[:, 1] * from_start[:, 0]
    last = along[:, 0] * from_end[:, 1] - along[:, 1] * from_end[:, 0]
    return bool(np.any((side[:, 0] * side[:, 1] < 0) & (first * last < 0)))
