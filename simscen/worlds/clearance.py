"""How far every place is from the nearest static solid, for the question where a disc of some radius may be."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.grid import OccupancyGrid
from simscen.core.shapes import TriangleMesh
from simscen.worlds.raster import Cells, filled, ranges, touched
from simscen.worlds.section import Section, section

MOST_LEVELS = 12
"""Cuts through the robot's height; walls and boxes need one, whatever their number."""
SPACING = 0.02
"""Metres between the points that stand for an outline: at 0.2 m, half of it away errs by 0.25 mm."""

NOTHING = 1e6
"""The clearance where there is no solid at all; finite, so that it can be interpolated."""


@dataclass(frozen=True, eq=False)
class ClearanceField:
    """Clearance in metres at the centres of a grid's cells, negative inside of solids.

    `values` (rows, columns) are exact to a millimetre within two cells of the clearance that was asked for, and good
    to a cell elsewhere. `blocked` are the cells that a solid reaches into.
    """

    grid: OccupancyGrid
    values: Array
    blocked: Cells

    def at(self, points: Array) -> Array:
        """Clearance (n,) at points (n, 2), interpolated between cells; points off the grid are taken to its edge."""
        return self._blend(points)[0]

    def uphill(self, points: Array) -> tuple[Array, Array]:
        """Clearance (n,) and the unit direction (n, 2) in which it grows."""
        values, slope = self._blend(points)
        steepness = np.linalg.norm(slope, axis=1)[:, None]
        return values, slope / np.where(steepness > 0, steepness, 1.0)

    def _blend(self, points: Array) -> tuple[Array, Array]:
        origin, resolution, (rows, columns) = self.grid.origin, self.grid.resolution, self.grid.shape
        x = np.clip((points[:, 0] - origin.x) / resolution - 0.5, 0, columns - 1.001)
        y = np.clip((points[:, 1] - origin.y) / resolution - 0.5, 0, rows - 1.001)
        column, row = x.astype(np.int64), y.astype(np.int64)
        u, v = x - column, y - row
        a, b = self.values[row, column], self.values[row, column + 1]
        c, d = self.values[row + 1, column], self.values[row + 1, column + 1]
        low, high = a + u * (b - a), c + u * (d - c)
        slope = np.column_stack(((1 - v) * (b - a) + v * (d - c), high - low))
        return low + v * (high - low), slope


def clearance_field(
    mesh: TriangleMesh, grid: OccupancyGrid, radius: float, z_range: tuple[float, float]
) -> ClearanceField:
    """The clearance from all of `mesh` between two heights, exact near `radius`; `grid` (no yaw) gives the lattice."""
    from scipy import ndimage, spatial

    cuts = standing_outlines(mesh, z_range)
    blocked, inside = np.zeros(grid.shape, np.bool_), np.zeros(grid.shape, np.bool_)
    for cut in cuts:
        local = Section((cut.segments - (grid.origin.x, grid.origin.y)) / grid.resolution, cut.owners)
        blocked |= touched(local, grid.shape)
        inside |= filled(local, grid.shape)
    samples = _along(np.concatenate([cut.segments for cut in cuts]))
    if not len(samples):
        return ClearanceField(grid, np.full(grid.shape, NOTHING), blocked)
    values = (ndimage.distance_transform_edt(~blocked) - 0.5) * grid.resolution
    near = np.abs(values - radius) <= 2.5 * grid.resolution
    centres = grid.centre_of(np.argwhere(near))
    values[near] = spatial.cKDTree(samples).query(centres)[0]
    return ClearanceField(grid, np.where(inside, -np.abs(values), values), blocked)


def standing_outlines(mesh: TriangleMesh, z_range: tuple[float, float]) -> list[Section]:
    """Cuts between two heights that show every upright wall and box there, and round things at MOST_LEVELS."""
    low, high = z_range
    z = np.unique(np.round(mesh.vertices[:, 2], 3))
    levels = np.concatenate(([low], z[(z > low) & (z < high)], [high]))
    middles = (levels[:-1] + levels[1:]) / 2
    if len(middles) > MOST_LEVELS:
        middles = np.linspace(low, high, MOST_LEVELS + 2)[1:-1]
    return [section(mesh, height) for height in middles.tolist()]


def _along(segments: Array) -> Array:
    """Points (n, 2) along segments (m, 2, 2), at most SPACING apart, ends included; the same point only once."""
    step = segments[:, 1] - segments[:, 0]
    pieces = np.maximum(np.ceil(np.linalg.norm(step, axis=1) / SPACING), 1).astype(np.int64)
    which, number = ranges(np.zeros_like(pieces), pieces + 1)
    points = segments[which, 0] + (number / pieces[which])[:, None] * step[which]
    keys: npt.NDArray[np.int64] = np.round(points / (SPACING / 20)).astype(np.int64)
    order = np.lexsort(keys.T)
    new = np.ones(len(order), dtype=np.bool_)
    new[1:] = np.any(np.diff(keys[order], axis=0) != 0, axis=1)
    distinct: Array = points[order[new]]
    return distinct
