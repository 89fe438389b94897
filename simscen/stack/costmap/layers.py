"""Static layer (map and keepout zones) and inflation of a costmap, and the speed filter.

Distances are stored as squares, in cells (uint16). Lookup tables convert the squares to distances in m and to costs.
Cells beyond the maximum distance have a square that is larger than the square of this distance.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import cached_on_instance
from simscen.core.environment.costmap_filters import Zones, in_keepout_mask
from simscen.core.environment.occupancy_grid import UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array, Polygon, Pose2
from simscen.core.geometry.polygons import distance_to_polygon, points_in_polygon
from simscen.stack.costmap.distance_transform import (
    MAX_REACH_CELLS,
    OUT_OF_REACH,
    squared_distance_blocks,
    squared_distances_within,
)
from simscen.stack.costmap.grid_frame import GridFrame
from simscen.stack.protocols import Surroundings

FREE, MAX_NON_OBSTACLE, INSCRIBED, LETHAL, NO_INFORMATION = 0, 252, 253, 254, 255
"""Costs of nav2_costmap_2d (cost_values.hpp)."""

Squared = npt.NDArray[np.uint16]
Costs = npt.NDArray[np.uint8]


def squared_distances(lethal: npt.NDArray[np.bool_], reach_cells: int) -> Squared:
    """Return the squared distance in cells of each cell to the nearest lethal cell, exact up to `reach_cells`."""
    if not lethal.any():
        return np.full(lethal.shape, OUT_OF_REACH, dtype=np.uint16)
    if reach_cells <= MAX_REACH_CELLS:
        return squared_distances_within(lethal, reach_cells)
    squared = np.empty(lethal.shape, dtype=np.uint16)
    for rows, distances in squared_distance_blocks(lethal):
        squared[rows] = np.where(
            distances <= reach_cells * reach_cells, np.minimum(distances, OUT_OF_REACH), OUT_OF_REACH
        )
    return squared


@lru_cache(maxsize=8)
def shared_inflation(resolution: float, inscribed: float, radius: float, scaling: float, reach_m: float) -> "Inflation":
    """Return the Inflation with these arguments, cached for all costmaps and runs."""
    return Inflation(resolution, inscribed, radius, scaling, reach_m)


class Inflation:
    """Lookup tables by squared distance in cells: `meters` contains the distance in m, `cost` Nav2's inflated cost.

    cost = 252 · exp(-scaling · (distance - inscribed)) between the inscribed and the inflation radius (computeCost in
    nav2_costmap_2d/inflation_layer.hpp). `meters` is at most `reach_m`.
    """

    def __init__(
        self, resolution: float, inscribed: float, inflation_radius: float, scaling: float, reach_m: float
    ) -> None:
        distance = np.sqrt(np.arange(OUT_OF_REACH + 1)) * resolution
        self.meters: npt.NDArray[np.float32] = np.minimum(distance, reach_m).astype(np.float32)
        decay = MAX_NON_OBSTACLE * np.exp(-scaling * np.maximum(distance - inscribed, 0.0))
        cost = np.where(distance <= inscribed, INSCRIBED, decay)
        cost = np.where(distance > inflation_radius, FREE, cost)
        cost[0] = LETHAL
        self.cost: npt.NDArray[np.uint8] = cost.astype(np.uint8)

    def costs(self, squared: npt.NDArray[np.integer], unknown: npt.NDArray[np.bool_] | None) -> Costs:
        """Return the costs of cells at squared distances. `unknown` cells are unknown unless inscribed or lethal."""
        cost = self.cost.take(squared)
        if unknown is not None:
            cost[unknown & (cost < INSCRIBED)] = NO_INFORMATION
        return cost


Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class StaticLayer:
    """Static part of a costmap: `lethal` and `unknown` cells (rows, columns) of `frame`."""

    frame: GridFrame
    lethal: Mask
    unknown: Mask


def static_layer(
    grid: OccupancyGrid,
    threshold: int,
    keepout: tuple[Polygon, ...],
    mask: OccupancyGrid | None = None,
    track_unknown: bool = True,
) -> StaticLayer:
    """Return the static layer of a map. A rotated map is sampled into an unrotated frame of the same resolution.

    Cells are lethal if their occupancy is at least `threshold` percent, or if keepout polygons or the keepout `mask`
    cover them. Without `track_unknown`, unknown cells are free.
    """
    if abs(grid.origin.yaw) < 1e-9:
        frame = GridFrame((grid.origin.x, grid.origin.y), grid.resolution, grid.shape)
        cells = grid.cells
    else:
        frame = _bounding_frame(grid)
        cells = grid.values_at(_all_centers(frame)).reshape(frame.shape)
    lethal = np.ascontiguousarray(cells >= threshold) | _keepout_cells(frame, keepout, mask)
    return StaticLayer(frame, lethal, (cells == UNKNOWN) & ~lethal & track_unknown)


@cached_on_instance
def layer_without_zones(grid: OccupancyGrid, threshold: int, track_unknown: bool) -> StaticLayer:
    """Return the static layer of a map without keepout zones. The result is cached: do not modify it."""
    return static_layer(grid, threshold, (), track_unknown=track_unknown)


@cached_on_instance
def static_distances(grid: OccupancyGrid, threshold: int, reach_cells: int) -> Squared:
    """Return squared distances to lethal cells of a map without zones. The result is cached: do not modify it."""
    return squared_distances(layer_without_zones(grid, threshold, True).lethal, reach_cells)


def empty_layer(
    frame: GridFrame, keepout: tuple[Polygon, ...], mask: OccupancyGrid | None = None, track_unknown: bool = False
) -> StaticLayer:
    """Return the static layer without a map: keepout cells are lethal, all others unknown or free."""
    return StaticLayer(frame, _keepout_cells(frame, keepout, mask), np.full(frame.shape, track_unknown))


def _keepout_cells(frame: GridFrame, keepout: tuple[Polygon, ...], mask: OccupancyGrid | None) -> Mask:
    """Return the cells (rows, columns) that keepout polygons or the keepout mask cover."""
    lethal = np.zeros(frame.shape, dtype=bool)
    for polygon in keepout:
        lethal |= points_in_polygon(polygon, _all_centers(frame)).reshape(frame.shape)
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
    """Return the smallest unrotated frame that contains a rotated map."""
    height, width = grid.shape
    corners = np.array([[0, 0], [width, 0], [0, height], [width, height]]) * grid.resolution
    corners = grid.origin.apply(corners)
    low, high = corners.min(axis=0), corners.max(axis=0)
    columns, rows = np.ceil((high - low) / grid.resolution).astype(int)
    return GridFrame((float(low[0]), float(low[1])), grid.resolution, (int(rows), int(columns)))


class SpeedFilter:
    """Speed limits of the current speed zones and speed mask."""

    def __init__(self, surroundings: Surroundings) -> None:
        """Take the initial speed zones and speed mask."""
        self._zones, self._mask = surroundings.speed_zones, surroundings.masks.speed
        self.is_used = bool(self._zones) or self._mask is not None
        """Whether there is or was a zone or a mask."""

    def set_zones(self, zones: Zones) -> None:
        """Replace all zones and masks."""
        self._zones, self._mask, self.is_used = zones.speed, zones.masks.speed, True

    def limit(self, pose: Pose2, full_speed: float) -> float | None:
        """Return the lowest limit in m/s at a pose; None without a limit. Masks can be percentages of `full_speed`."""
        limits = [limit for polygon, limit in self._zones if distance_to_polygon(pose, polygon) == 0.0]
        masked = self._mask.at(pose, full_speed) if self._mask is not None else None
        return min(limits if masked is None else [*limits, masked], default=None)
