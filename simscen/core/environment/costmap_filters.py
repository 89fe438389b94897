"""Masks (grids) and zones (polygons) of Nav2's costmap filters KeepoutFilter and SpeedFilter."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, Polygon, Pose2

if TYPE_CHECKING:
    import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class FilterMasks:
    """Filter masks that a stack receives; None for a mask that the stack does not receive."""

    keepout: OccupancyGrid | None = None
    speed: SpeedLimits | None = None


@dataclass(frozen=True, eq=False)
class SpeedLimits:
    """Mask of speed limits.

    A cell of `grid` with the value v limits the speed to `base + multiplier * v`: in percent of full speed if
    `percent`, otherwise in m/s.
    """

    grid: OccupancyGrid
    percent: bool
    base: float
    multiplier: float

    @property
    def has_limits(self) -> bool:
        """Whether any cell limits the speed."""
        return any(self.limit_of_cell(int(value), 1.0) is not None for value in np.unique(self.grid.cells))

    def at(self, pose: Pose2, full_speed: float) -> float | None:
        """Return the limit in m/s at a pose in the map frame; None if there is no limit.

        `full_speed` is the maximum speed of the controller in m/s.
        """
        value = int(self.grid.values_at(np.array([[pose.x, pose.y]]))[0])
        return self.limit_of_cell(value, full_speed)

    def at_points(self, points: Array, full_speed: float) -> Array:
        """Return the limits (n,) in m/s at points (n, 2) in the map frame; inf where there is no limit."""
        values = self.grid.values_at(points)
        limits = np.full(len(points), np.inf)
        for value in np.unique(values).tolist():
            limit = self.limit_of_cell(value, full_speed)
            limits[values == value] = np.inf if limit is None else limit
        return limits

    def limit_of_cell(self, value: int, full_speed: float) -> float | None:
        """Return the limit in m/s for the value of a cell; None if there is no limit.

        As in Nav2's SpeedFilter, values and limits of 0 or less mean no limit, as do limits above 100 %.
        """
        limit = self.base + self.multiplier * value
        if value <= 0 or limit <= 0 or (self.percent and limit > 100):
            return None
        return full_speed * limit / 100 if self.percent else limit


def in_keepout_mask(mask: OccupancyGrid, points: Array) -> npt.NDArray[np.bool_]:
    """Return for each of the points (n, 2) in the map frame whether it lies in an occupied cell of a keepout mask."""
    return np.asarray(mask.values_at(points) == OCCUPIED)


Block = tuple[int, int, int, int, int]
"""Rectangle of equal cells: first column, first row, width, height, and the value of the cells."""


@dataclass(frozen=True)
class MaskBlocks:
    """Compact form of a filter mask for logs: disjoint `blocks` of cells with values from 1 to 100.

    `resolution` is in m per cell. `origin` is the pose of the corner of cell (0, 0) in the map frame.
    """

    resolution: float
    origin: Pose2 = Pose2(0.0, 0.0, 0.0)
    blocks: tuple[Block, ...] = ()

    @property
    def grid(self) -> OccupancyGrid:
        """The mask as the smallest grid that contains all blocks; other cells are free."""
        width = max((column + width for column, _, width, _, _ in self.blocks), default=0)
        height = max((row + height for _, row, _, height, _ in self.blocks), default=0)
        cells = np.full((height, width), FREE, dtype=np.int8)
        for column, row, block_width, block_height, value in self.blocks:
            cells[row : row + block_height, column : column + block_width] = value
        return OccupancyGrid(cells, self.resolution, self.origin)

    @property
    def occupied_boxes(self) -> Array:
        """Occupied blocks (n, 4) as min x, min y, max x, max y, in m in the frame of the mask."""
        cells_xywh = np.array([block[:4] for block in self.blocks if block[4] == OCCUPIED], dtype=np.float64).reshape(
            -1, 4
        )
        cells_xywh[:, 2:] += cells_xywh[:, :2]
        boxes: Array = cells_xywh * self.resolution
        return boxes

    def to_mask_frame(self, poses: Array) -> Array:
        """Transform poses (n, 3), given as x, y, yaw, from the map frame to the frame of the mask."""
        local = self.origin.inverse().apply(poses[:, :2])
        return np.column_stack((local, poses[:, 2] - self.origin.yaw))


def mask_blocks(grid: OccupancyGrid) -> MaskBlocks:
    """Divide a mask into blocks. A block is a strip of equal cells in a row that repeats in the following rows."""
    blocks: list[Block] = []
    first_row: dict[tuple[int, int, int], int] = {}
    for row in range(len(grid.cells) + 1):
        if 0 < row < len(grid.cells) and np.array_equal(grid.cells[row], grid.cells[row - 1]):
            continue
        strips = _strips(grid.cells[row]) if row < len(grid.cells) else []
        current_strips = set(strips)
        for strip in [strip for strip in first_row if strip not in current_strips]:
            column, width, value = strip
            blocks.append((column, first_row[strip], width, row - first_row.pop(strip), value))
        for strip in strips:
            first_row.setdefault(strip, row)
    return MaskBlocks(float(grid.resolution), grid.origin, tuple(blocks))


def _strips(row: npt.NDArray[np.int8]) -> list[tuple[int, int, int]]:
    """Return first column, width, and value of each strip of equal cells above 0 in a row (columns,) of a mask."""
    edges = np.concatenate(([0], np.flatnonzero(np.diff(row)) + 1, [len(row)])).tolist()
    return [(a, b - a, int(row[a])) for a, b in pairwise(edges) if b > a and row[a] > FREE]


Filter = Literal["keepout", "speed"]
"""Kind of costmap filter: KeepoutFilter or SpeedFilter of Nav2."""


@dataclass(frozen=True, eq=False)
class Zones:
    """Enabled zones and masks of the costmap filters, in the map frame.

    `keepout` contains the polygons of keepout zones. `speed` contains pairs of a polygon and its speed limit in m/s.
    """

    keepout: tuple[Polygon, ...] = ()
    speed: tuple[tuple[Polygon, float], ...] = ()
    masks: FilterMasks = field(default_factory=FilterMasks)


@dataclass(frozen=True)
class ZoneSwitch:
    """Command that enables or disables a zone of a costmap filter.

    `region` is the region of the zone; None for all zones and the mask of the filter. `speed_limit` is the new limit of
    a zone of the speed filter in m/s; None keeps the limit.
    """

    filter: Filter
    enabled: bool
    region: str | None = None
    speed_limit: float | None = None
