"""Compute the clearance: the distance to the nearest static solid."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array
from simscen.core.geometry.shapes import TriangleMesh
from simscen.worlds.geometry.cross_section import CrossSection, sections_between
from simscen.worlds.maps.map_size import MAP_MARGIN_M, Bounds
from simscen.worlds.maps.occupancy_map import empty_grid
from simscen.worlds.maps.rasterization import CellMask, expand_ranges, filled_cells, touched_cells

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

MIN_RESOLUTION_M = 0.05
"""Minimum size of the cells of a grid on which paths or gaps are searched."""
MAX_CELLS = 1_000_000
"""Approximate maximum number of cells of a grid. The cells of larger worlds are larger."""
OUTLINE_SPACING_M = 0.02
"""Distance between the points of an outline. The error of a clearance of 0.2 m is then at most 0.25 mm."""
CLEARANCE_WITHOUT_SOLIDS_M = 1e6
"""Clearance in a world without solids."""
HALF_DIAGONAL_CELLS = 0.7072
"""Half of a cell's diagonal, in cells: the maximum distance of a point from the center of its cell."""


@dataclass(frozen=True, eq=False)
class ClearanceField:
    """Clearance (distance to the nearest solid): approximate for each cell of a grid, exact for single points.

    grid:            grid without yaw; only its size, resolution, and origin are used
    cell_clearance:  distance (rows, columns) in m from the center of each cell to the center of the nearest cell that a
                     solid touches; differs from the exact clearance by at most HALF_DIAGONAL_CELLS
    is_inside:       mask of the cells whose center is in a solid
    outline:         points on the outlines of all solids, OUTLINE_SPACING_M apart; None without solids
    owners:          index (n,) in `names` of the solid that each point of `outline` belongs to
    names:           names of the solids
    """

    grid: OccupancyGrid
    cell_clearance: Array
    is_inside: CellMask
    outline: "cKDTree | None"
    owners: npt.NDArray[np.int32]
    names: tuple[str, ...] = ()

    def clearance_at(self, points: Array) -> Array:
        """Return the clearance (n,) in m at points (n, 2); negative inside solids."""
        return self._nearest(points)[0]

    def has_clearance(self, points: Array, distance: float) -> npt.NDArray[np.bool_]:
        """Return for each of the points (n, 2) whether it is at least `distance` m away from all solids."""
        approximate = self.cell_clearance[self._cells(points)]
        # Twice, because the point and the outline may each be half a diagonal away from the center of their cells.
        has_clearance: npt.NDArray[np.bool_] = approximate >= distance + 2 * HALF_DIAGONAL_CELLS * self.grid.resolution
        is_undecided = ~has_clearance
        has_clearance[is_undecided] = self.clearance_at(points[is_undecided]) >= distance
        return has_clearance

    def free_cells(self, distance: float) -> CellMask:
        """Return the mask of the cells whose center is at least `distance` m away from all solids."""
        slack = HALF_DIAGONAL_CELLS * self.grid.resolution
        is_free: CellMask = (self.cell_clearance >= distance + slack) & ~self.is_inside
        is_undecided = (np.abs(self.cell_clearance - distance) < slack) & ~self.is_inside
        is_free[is_undecided] = self.clearance_at(self.grid.center_of(np.argwhere(is_undecided))) >= distance
        return is_free

    def push_away(self, points: Array, distance: float) -> Array:
        """Return translations (n, 2) in m that move points (n, 2) to `distance` m from their nearest solid.

        The translations of points that are farther away are zero.
        """
        moves = np.zeros_like(points)
        slack = 2 * HALF_DIAGONAL_CELLS * self.grid.resolution
        is_near = self.cell_clearance[self._cells(points)] < distance + slack
        clearance, gradients = self._nearest(points[is_near])
        moves[is_near] = np.maximum(distance - clearance, 0.0)[:, None] * gradients
        return moves

    def _nearest(self, points: Array) -> tuple[Array, Array]:
        """Return the clearance (n,) in m at points (n, 2), and its gradient (n, 2), unit vectors away from solids."""
        if self.outline is None:
            return np.full(len(points), CLEARANCE_WITHOUT_SOLIDS_M), np.zeros_like(points)
        distances, numbers = self.outline.query(points)
        sign = np.where(self.is_inside[self._cells(points)], -1.0, 1.0)
        offsets = points - self.outline.data[numbers]
        return sign * distances, offsets * (sign / np.where(distances > 0, distances, 1.0))[:, None]

    def _cells(self, points: Array) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Return rows (n,) and columns (n,) of the cells of points (n, 2); outside the grid, the nearest cells."""
        rows, columns = self.grid.cell_of(points).T
        return np.clip(rows, 0, self.grid.shape[0] - 1), np.clip(columns, 0, self.grid.shape[1] - 1)


def search_grid(bounds: Bounds, radius: float, min_resolution: float = MIN_RESOLUTION_M) -> OccupancyGrid:
    """Return an empty grid for the search for paths of a disc of `radius` m, with room for a path around the world.

    `bounds` are the bounds of the world. Cells are `min_resolution` m wide, or wider in a large world.
    """
    x0, y0, x1, y1 = bounds
    margin = 2 * radius
    width, height = (side + 2 * margin + 2 * MAP_MARGIN_M for side in (x1 - x0, y1 - y0))
    resolution = max(min_resolution, math.sqrt(width * height / MAX_CELLS))
    return empty_grid((x0 - margin, y0 - margin, x1 + margin, y1 + margin), resolution)


def clearance_field(mesh: TriangleMesh, grid: OccupancyGrid, z_range: tuple[float, float]) -> ClearanceField:
    """Return the clearance from the part of a mesh between two heights, on the cells of `grid`, which has no yaw."""
    from scipy import ndimage, spatial

    sections = sections_between(mesh, z_range)
    is_touched, is_inside = np.zeros(grid.shape, np.bool_), np.zeros(grid.shape, np.bool_)
    for section in sections:
        points_in_cells = (section.segments - (grid.origin.x, grid.origin.y)) / grid.resolution
        section_in_cells = CrossSection(points_in_cells, section.owners)
        is_touched |= touched_cells(section_in_cells, grid.shape)
        is_inside |= filled_cells(section_in_cells, grid.shape)
    segments = np.concatenate([section.segments for section in sections])
    samples, owners = _sample_segments(segments, np.concatenate([section.owners for section in sections]))
    if not is_touched.any():
        return ClearanceField(grid, np.full(grid.shape, CLEARANCE_WITHOUT_SOLIDS_M), is_inside, None, owners)
    cell_clearance = ndimage.distance_transform_edt(~is_touched) * grid.resolution
    return ClearanceField(grid, cell_clearance, is_inside, spatial.cKDTree(samples), owners, mesh.names)


def _sample_segments(segments: Array, owners: npt.NDArray[np.int32]) -> tuple[Array, npt.NDArray[np.int32]]:
    """Return points (n, 2) along segments (m, 2, 2), at most OUTLINE_SPACING_M apart, without duplicates.

    Also returns the owner (n,) of each point. `owners` (m,) are the owners of the segments.
    """
    step = segments[:, 1] - segments[:, 0]
    piece_counts = np.maximum(np.ceil(np.linalg.norm(step, axis=1) / OUTLINE_SPACING_M), 1).astype(np.int64)
    segment, number = expand_ranges(np.zeros_like(piece_counts), piece_counts + 1)
    points = segments[segment, 0] + (number / piece_counts[segment])[:, None] * step[segment]
    keys: npt.NDArray[np.int64] = np.round(points / (OUTLINE_SPACING_M / 20)).astype(np.int64)
    order = np.lexsort(keys.T)
    is_new = np.ones(len(order), dtype=np.bool_)
    is_new[1:] = np.any(np.diff(keys[order], axis=0) != 0, axis=1)
    distinct: Array = points[order[is_new]]
    return distinct, owners[segment][order[is_new]]
