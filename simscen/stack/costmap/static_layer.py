"""Static layer of a costmap: map (nav2_costmap_2d's static layer), keepout zones, and keepout mask (keepout filter)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import cached_on_instance
from simscen.core.environment.costmap_filters import in_keepout_mask
from simscen.core.environment.occupancy_grid import UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array, Polygon
from simscen.core.geometry.polygons import points_in_polygon
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.distance_transform import Squared, squared_distances_within
from simscen.stack.costmap.grid_frame import GridFrame, Mask
from simscen.stack.costmap.inflation import Costs, Inflation
from simscen.stack.protocols import Surroundings


@dataclass(frozen=True, eq=False)
class StaticLayer:
    """Static part of a costmap. The arrays (rows, columns) must not be modified.

    frame:       grid of the cells
    squared:     squared distances in cells to the nearest lethal cell, exact up to a maximum distance
    has_lethal:  whether any cell is lethal
    unknown:     mask of unknown cells; None if unknown cells count as free
    """

    frame: GridFrame
    squared: Squared
    has_lethal: bool
    unknown: Mask | None

    @property
    def lethal_cell_count(self) -> int:
        """Number of lethal cells."""
        return int(np.count_nonzero(self.squared == 0))

    @cached_on_instance
    def costs(self, inflation: Inflation) -> Costs:
        """Return the costs (rows, columns) without live obstacles. Cached."""
        return inflation.costs(self.squared, self.unknown)


def static_layer(spec: CostmapSpec, surroundings: Surroundings, window: GridFrame, reach_cells: int) -> StaticLayer:
    """Return the static layer of the map with keepout zones. Without a map, the cells of `window` are unknown or free.

    Distances are exact up to `reach_cells` cells.
    """
    grid, keepout, mask = surroundings.map, surroundings.keepout, surroundings.masks.keepout
    if grid is not None and not keepout and mask is None:
        return map_layer(grid, spec.lethal_cost_threshold, spec.track_unknown_space, reach_cells)
    if grid is None:
        frame, lethal, unknown = window, _keepout_cells(window, keepout, mask), np.ones(window.shape, dtype=bool)
    else:
        frame, cells = _unrotated_cells(grid)
        lethal = (cells >= spec.lethal_cost_threshold) | _keepout_cells(frame, keepout, mask)
        unknown = (cells == UNKNOWN) & ~lethal
    return _make_layer(frame, lethal, unknown if spec.track_unknown_space else None, reach_cells)


@cached_on_instance
def map_layer(grid: OccupancyGrid, threshold: int, track_unknown: bool, reach_cells: int) -> StaticLayer:
    """Return the static layer of a map without keepout zones, cached in the map.

    Cells are lethal if their occupancy is at least `threshold` percent. Unknown cells are free unless `track_unknown`.
    """
    frame, cells = _unrotated_cells(grid)
    return _make_layer(frame, cells >= threshold, cells == UNKNOWN if track_unknown else None, reach_cells)


def _make_layer(frame: GridFrame, lethal: Mask, unknown: Mask | None, reach_cells: int) -> StaticLayer:
    return StaticLayer(frame, squared_distances_within(lethal, reach_cells), bool(lethal.any()), unknown)


def _unrotated_cells(grid: OccupancyGrid) -> tuple[GridFrame, npt.NDArray[np.int8]]:
    """Return the grid and the cells (rows, columns) of a map. A rotated map is sampled into an unrotated grid."""
    if abs(grid.origin.yaw) < 1e-9:
        return GridFrame((grid.origin.x, grid.origin.y), grid.resolution, grid.shape), grid.cells
    frame = _bounding_frame(grid)
    return frame, grid.values_at(_all_centers(frame)).reshape(frame.shape)


def _keepout_cells(frame: GridFrame, keepout: tuple[Polygon, ...], mask: OccupancyGrid | None) -> Mask:
    """Return the mask (rows, columns) of the cells that keepout polygons or the keepout mask cover."""
    lethal = np.zeros(frame.shape, dtype=bool)
    if keepout:
        centers = _all_centers(frame)
        for polygon in keepout:
            lethal |= points_in_polygon(polygon, centers).reshape(frame.shape)
    if mask is not None:
        columns = np.arange(frame.shape[1])
        for row in range(frame.shape[0]):
            lethal[row] |= in_keepout_mask(mask, frame.centers(np.column_stack((np.full_like(columns, row), columns))))
    return lethal


def _all_centers(frame: GridFrame) -> Array:
    """Return the centers (n, 2) of all cells, row by row."""
    rows, columns = np.indices(frame.shape)
    return frame.centers(np.column_stack((rows.ravel(), columns.ravel())))


def _bounding_frame(grid: OccupancyGrid) -> GridFrame:
    """Return the smallest unrotated grid that contains a rotated map."""
    height, width = grid.shape
    corners = np.array([[0, 0], [width, 0], [0, height], [width, height]]) * grid.resolution
    corners = grid.origin.apply(corners)
    low, high = corners.min(axis=0), corners.max(axis=0)
    columns, rows = np.ceil((high - low) / grid.resolution).astype(int)
    return GridFrame((float(low[0]), float(low[1])), grid.resolution, (int(rows), int(columns)))
