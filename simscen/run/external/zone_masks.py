"""Draw keepout and speed zones (polygons) into masks of Nav2's costmap filters, for stacks that need masks.

Each filter (keepout, speed) has one mask with the enabled zones and the mask file of the stack.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from simscen.core.environment.costmap_filters import SpeedLimits, Zones
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.polygons import points_in_polygon
from simscen.run.external.protocol import KEEPOUT_ZONES, SPEED_ZONES

if TYPE_CHECKING:
    import numpy.typing as npt

    from simscen.core.geometry import Polygon
    from simscen.record.topics import Topic
    from simscen.run.preparation import PreparedScenario
    from simscen.stack.protocols import Surroundings

    Cells = tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]

CELL_M = 0.05
"""Cell size of masks for robots without a map."""
SPEED_STEP_M_S = 0.01
"""Smallest step between the speed limits in a mask, if the stack has no mask file."""


def switchable_zones(prepared: PreparedScenario) -> Zones:
    """Return the zones that events can switch during the run, with the speed limits of these events (0: none)."""
    keepout: list[Polygon] = []
    speed: list[tuple[Polygon, float]] = []
    for action in prepared.loaded.actions:
        if action.kind in ("keepout", "speed_zone") and action.spec.region is not None:
            region = prepared.built.world.regions[action.spec.region]
            if action.kind == "keepout":
                keepout.append(region)
            else:
                speed.append((region, action.spec.speed_limit or 0.0))
    return Zones(tuple(keepout), tuple(speed))


class ZoneMasks:
    """Masks with the enabled zones of one robot.

    A mask covers the map or, without a map, all zones. Without zones, a mask is the mask file of the stack.
    """

    def __init__(self, surroundings: Surroundings, switchable: Zones) -> None:
        """`surroundings` has the zones at the start of the run. `switchable` are the zones that events can switch."""
        keepout = (*surroundings.keepout, *switchable.keepout)
        speed = (*surroundings.speed_zones, *switchable.speed)
        masks = surroundings.masks
        grid = surroundings.map or _grid_around([*keepout, *(polygon for polygon, _ in speed)])
        self._keepout = grid if keepout else masks.keepout
        speed_file = masks.speed.grid if masks.speed is not None else None
        self._speed = _SpeedMask(grid if speed else speed_file, masks.speed, speed, surroundings)
        self._drawn: dict[Topic, OccupancyGrid] = {}

    def changed_masks(self, zones: Zones) -> Iterator[tuple[Topic, OccupancyGrid]]:
        """Yield the masks with the enabled `zones` that have changed since the last call; at first, all masks."""
        for topic, grid in self._draw_masks(zones):
            before = self._drawn.get(topic)
            if before is None or not np.array_equal(before.cells, grid.cells):
                self._drawn[topic] = grid
                yield topic, grid

    def _draw_masks(self, zones: Zones) -> Iterator[tuple[Topic, OccupancyGrid]]:
        if self._keepout is not None:
            cells = _cells_of(zones.masks.keepout, self._keepout)
            for polygon in zones.keepout:
                cells[_cells_inside(self._keepout, polygon)] = OCCUPIED
            yield KEEPOUT_ZONES, replace(self._keepout, cells=cells)
        if self._speed.grid is not None:
            yield SPEED_ZONES, self._speed.draw(self._speed.grid, zones)

    @property
    def meanings(self) -> list[dict[str, Any]]:
        """Data for HELLO: `topic` and `filter` of each mask, and `percent`, `base`, `multiplier` of the speed mask."""
        keepout = {"topic": KEEPOUT_ZONES.name, "filter": "keepout"}
        speed = {"topic": SPEED_ZONES.name, "filter": "speed", **self._speed.scale}
        return [
            *([keepout] if self._keepout is not None else []),
            *([speed] if self._speed.grid is not None else []),
        ]


class _SpeedMask:
    """Mask of speed limits in the cells of `grid` (None: there are no limits)."""

    def __init__(
        self,
        grid: OccupancyGrid | None,
        file: SpeedLimits | None,
        zones: tuple[tuple[Polygon, float], ...],
        surroundings: Surroundings,
    ) -> None:
        self.grid, self._full_speed = grid, surroundings.robot.max_linear
        fastest = max((limit for _, limit in zones), default=0.0)
        if zones and file is not None and not file.multiplier:  # the scale of this file cannot express other limits
            fastest, file = max(fastest, file.limit_of_cell(1, self._full_speed) or 0.0), None
        self._percent = file is not None and file.percent
        self._base = 0.0 if file is None else file.base
        self._multiplier = max(SPEED_STEP_M_S, fastest / OCCUPIED) if file is None else file.multiplier
        self.scale = {"percent": self._percent, "base": self._base, "multiplier": self._multiplier}
        """Parameters that convert values of the mask to speeds, as in Nav2."""

    def draw(self, grid: OccupancyGrid, zones: Zones) -> OccupancyGrid:
        if not zones.speed and zones.masks.speed is not None and grid is zones.masks.speed.grid:
            return grid
        limits: Array = np.full(grid.shape, np.inf)
        if zones.masks.speed is not None:
            limits = zones.masks.speed.at_points(_centers(grid), self._full_speed).reshape(grid.shape)
        for polygon, limit in zones.speed:
            inside = _cells_inside(grid, polygon)
            limits[inside] = np.minimum(limits[inside], limit)
        limited = np.isfinite(limits)
        amounts = limits[limited] * (100 / self._full_speed if self._percent else 1.0)
        values = (amounts - self._base) / self._multiplier
        # A limit between two values becomes the lower one.
        rounded = np.floor(values + 1e-9) if self._multiplier > 0 else np.ceil(values - 1e-9)
        cells = np.full(grid.shape, FREE, dtype=np.int8)
        cells[limited] = np.clip(rounded, 1, OCCUPIED)
        return replace(grid, cells=cells)


def _grid_around(polygons: list[Polygon]) -> OccupancyGrid:
    """Return a free grid that covers all polygons."""
    corners = np.array([corner for polygon in polygons for corner in polygon] or [(0.0, 0.0)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    columns, rows = np.maximum(1, np.ceil((high - low) / CELL_M)).astype(int)
    origin = Pose2(float(low[0]), float(low[1]), 0.0)
    return OccupancyGrid(np.full((rows, columns), FREE, dtype=np.int8), CELL_M, origin)


def _cells_of(mask: OccupancyGrid | None, grid: OccupancyGrid) -> npt.NDArray[np.int8]:
    """Return the values of a mask at the cells of `grid`; FREE outside of the mask, and without a mask."""
    if mask is None:
        return np.full(grid.shape, FREE, dtype=np.int8)
    if mask is grid:
        return np.array(mask.cells)
    cells: npt.NDArray[np.int8] = np.maximum(mask.values_at(_centers(grid)), FREE).reshape(grid.shape)
    return cells


def _cells_inside(grid: OccupancyGrid, polygon: Polygon) -> Cells:
    """Return the rows and columns of the cells with centers inside a polygon."""
    corners = grid.cell_of(np.array(polygon))
    low = np.maximum(corners.min(axis=0), 0)
    high = np.minimum(corners.max(axis=0) + 1, grid.shape)
    rows, columns = np.mgrid[low[0] : high[0], low[1] : high[1]]
    cells = np.column_stack((rows.ravel(), columns.ravel()))
    cells = cells[points_in_polygon(polygon, grid.center_of(cells))]
    return cells[:, 0], cells[:, 1]


def _centers(grid: OccupancyGrid) -> Array:
    """Return the centers (n, 2) in m of all cells, row by row."""
    rows, columns = np.indices(grid.shape)
    return grid.center_of(np.column_stack((rows.ravel(), columns.ravel())))
