"""Costmap filter masks and zones with the meaning of nav2_costmap_2d: keepout and speed limits."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, Pose2

if TYPE_CHECKING:
    import numpy.typing as npt

    from simscen.core.environment.world_model import Polygon


@dataclass(frozen=True, eq=False)
class FilterMasks:
    """Filter masks of a stack: keepout areas and speed limits. None means no such mask."""

    keepout: OccupancyGrid | None = None
    speed: SpeedLimits | None = None


@dataclass(frozen=True, eq=False)
class SpeedLimits:
    """Mask of speed limits; a cell of value v allows `base + multiplier * v` m/s, or percent of full speed."""

    grid: OccupancyGrid
    percent: bool
    base: float
    multiplier: float

    @property
    def has_limits(self) -> bool:
        """Whether any cell limits the speed."""
        return any(self.of(int(value), 1.0) is not None for value in np.unique(self.grid.cells))

    def at(self, pose: Pose2, full_speed: float) -> float | None:
        """Return the limit in m/s at the pose of the robot, or None.

        `full_speed` is the top speed of the controller in m/s.
        """
        value = int(self.grid.values_at(np.array([[pose.x, pose.y]]))[0])
        return self.of(value, full_speed)

    def along(self, points: Array, full_speed: float) -> Array:
        """Return the limits (n,) in m/s at points (n, 2); inf for no limit."""
        values = self.grid.values_at(points)
        limits = np.full(len(points), np.inf)
        for value in np.unique(values).tolist():
            limit = self.of(value, full_speed)
            limits[values == value] = np.inf if limit is None else limit
        return limits

    def of(self, value: int, full_speed: float) -> float | None:
        """Return the limit in m/s for the value of a cell, or None.

        As in Nav2's SpeedFilter, a limit of 0, below 0, or above 100 percent means no limit.
        """
        limit = self.base + self.multiplier * value
        if value <= 0 or limit <= 0 or (self.percent and limit > 100):
            return None
        return full_speed * limit / 100 if self.percent else limit


def in_keepout_mask(mask: OccupancyGrid, points: Array) -> npt.NDArray[np.bool_]:
    """Return which of the points (n, 2) a keepout mask forbids; lighter cells do not forbid anything."""
    return np.asarray(mask.values_at(points) == OCCUPIED)


Block = tuple[int, int, int, int, int]
"""Column, row, width and height in cells, and the value of all its cells."""


@dataclass(frozen=True)
class MaskBlocks:
    """The cells of a mask with values from 1 to 100, as `blocks` that do not overlap.

    `resolution` is in m per cell, and `origin` is the corner of cell (0, 0), as in OccupancyGrid.
    """

    resolution: float
    origin: Pose2 = Pose2(0.0, 0.0, 0.0)
    blocks: tuple[Block, ...] = ()

    @property
    def grid(self) -> OccupancyGrid:
        """The mask as a grid, just large enough for all blocks."""
        width = max((column + width for column, _, width, _, _ in self.blocks), default=0)
        height = max((row + height for _, row, _, height, _ in self.blocks), default=0)
        cells = np.full((height, width), FREE, dtype=np.int8)
        for column, row, wide, high, value in self.blocks:
            cells[row : row + high, column : column + wide] = value
        return OccupancyGrid(cells, self.resolution, self.origin)

    @property
    def forbidden(self) -> Array:
        """The occupied blocks (n, 4) as min x, min y, max x, max y in m in the frame of the mask."""
        cells_xywh = np.array([block[:4] for block in self.blocks if block[4] == OCCUPIED], dtype=np.float64).reshape(
            -1, 4
        )
        cells_xywh[:, 2:] += cells_xywh[:, :2]
        boxes: Array = cells_xywh * self.resolution
        return boxes

    def to_mask_frame(self, poses: Array) -> Array:
        """Return poses (n, 3) of the map frame in the frame of the mask."""
        local = self.origin.inverse().apply(poses[:, :2])
        return np.column_stack((local, poses[:, 2] - self.origin.yaw))


def mask_blocks(grid: OccupancyGrid) -> MaskBlocks:
    """Return the blocks of a mask: runs of equal cells in a row, extended over the following rows with the same run."""
    blocks: list[Block] = []
    first_row: dict[tuple[int, int, int], int] = {}
    for row in range(len(grid.cells) + 1):
        if 0 < row < len(grid.cells) and np.array_equal(grid.cells[row], grid.cells[row - 1]):
            continue
        runs = _runs(grid.cells[row]) if row < len(grid.cells) else []
        current_runs = set(runs)
        for run in [run for run in first_row if run not in current_runs]:
            column, width, value = run
            blocks.append((column, first_row[run], width, row - first_row.pop(run), value))
        for run in runs:
            first_row.setdefault(run, row)
    return MaskBlocks(float(grid.resolution), grid.origin, tuple(blocks))


def _runs(cells: npt.NDArray[np.int8]) -> list[tuple[int, int, int]]:
    """Return column, width and value of each run of equal cells with a value above 0."""
    edges = np.concatenate(([0], np.flatnonzero(np.diff(cells)) + 1, [len(cells)])).tolist()
    return [(a, b - a, int(cells[a])) for a, b in pairwise(edges) if b > a and cells[a] > FREE]


Filter = Literal["keepout", "speed"]


@dataclass(frozen=True, eq=False)
class Zones:
    """State of the costmap filters: `keepout` polygons, and `speed` polygons with their limits in m/s."""

    keepout: tuple[Polygon, ...] = ()
    speed: tuple[tuple[Polygon, float], ...] = ()
    masks: FilterMasks = field(default_factory=FilterMasks)


@dataclass(frozen=True)
class ZoneSwitch:
    """Command that enables or disables a zone, or, if `region` is None, a whole filter with its zones and mask.

    `speed_limit` (m/s) sets the limit of a zone of the speed filter; None keeps its limit.
    """

    filter: Filter
    enabled: bool
    region: str | None = None
    speed_limit: float | None = None
