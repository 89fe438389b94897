"""Static layer: the map as an unrotated grid, with keepout zones and masks."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import cached_on_instance
from simscen.core.environment.costmap_filters import in_keepout_mask
from simscen.core.environment.occupancy_grid import UNKNOWN, OccupancyGrid
from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Array
from simscen.core.geometry.polygons import points_in_polygon
from simscen.stack.costmap.grid_frame import GridFrame
from simscen.stack.costmap.inflation_layer import Squared, squared_distances

Mask = npt.NDArray[np.bool_]
OCCUPIED_THRESHOLD = 65
"""nav2's lethal_cost_threshold is 100 on a trinary map; 65 also reads maps that were loaded in scale mode."""


@dataclass(frozen=True, eq=False)
class StaticLayer:
    """Static part of a costmap: `lethal` and `unknown` cells (rows, columns) of `frame`."""

    frame: GridFrame
    lethal: Mask
    unknown: Mask


def static_layer(
    grid: OccupancyGrid, keepout: tuple[Polygon, ...], mask: OccupancyGrid | None = None, unknown: bool = True
) -> StaticLayer:
    """Return the layer of a map; a rotated map is sampled into an unrotated frame of the same resolution.

    Without tracking of `unknown` space, unknown cells are free, as in Nav2.
    """
    if abs(grid.origin.yaw) < 1e-9:
        frame = GridFrame((grid.origin.x, grid.origin.y), grid.resolution, grid.shape)
        cells = grid.cells
    else:
        frame = _bounding_frame(grid)
        cells = grid.values_at(_all_centers(frame)).reshape(frame.shape)
    lethal = np.ascontiguousarray(cells >= OCCUPIED_THRESHOLD) | _keepout_cells(frame, keepout, mask)
    return StaticLayer(frame, lethal, (cells == UNKNOWN) & ~lethal & unknown)


@cached_on_instance
def free_layer(grid: OccupancyGrid, unknown: bool) -> StaticLayer:
    """Return the layer of a map without zones, computed once for all runs, which write into copies."""
    return static_layer(grid, (), unknown=unknown)


@cached_on_instance
def static_distances(grid: OccupancyGrid, reach: int) -> Squared:
    """Return the squared distances in a layer without zones, computed once for all runs."""
    return squared_distances(free_layer(grid, True).lethal, reach)


def empty_layer(
    frame: GridFrame, keepout: tuple[Polygon, ...], mask: OccupancyGrid | None = None, unknown: bool = False
) -> StaticLayer:
    """Return the layer of a robot without a map: only keepout zones and masks; the rest is `unknown` or free."""
    return StaticLayer(frame, _keepout_cells(frame, keepout, mask), np.full(frame.shape, unknown))


def _keepout_cells(frame: GridFrame, keepout: tuple[Polygon, ...], mask: OccupancyGrid | None) -> Mask:
    lethal = np.zeros(frame.shape, dtype=bool)
    for polygon in keepout:
        lethal |= inside_polygon(frame, polygon)
    if mask is not None:
        columns = np.arange(frame.shape[1])
        for row in range(frame.shape[0]):
            lethal[row] |= in_keepout_mask(mask, frame.centers(np.column_stack((np.full_like(columns, row), columns))))
    return lethal


def inside_polygon(frame: GridFrame, polygon: Polygon) -> Mask:
    """Return the cells whose center is inside the polygon (even-odd rule)."""
    return points_in_polygon(polygon, _all_centers(frame)).reshape(frame.shape)


def _all_centers(frame: GridFrame) -> Array:
    rows, columns = np.indices(frame.shape)
    return frame.centers(np.column_stack((rows.ravel(), columns.ravel())))


def _bounding_frame(grid: OccupancyGrid) -> GridFrame:
    height, width = grid.shape
    corners = np.array([[0, 0], [width, 0], [0, height], [width, height]]) * grid.resolution
    corners = grid.origin.apply(corners)
    low, high = corners.min(axis=0), corners.max(axis=0)
    columns, rows = np.ceil((high - low) / grid.resolution).astype(int)
    return GridFrame((float(low[0]), float(low[1])), grid.resolution, (int(rows), int(columns)))
