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
    """What a stack is told to keep out of, and where to drive slowly; None for no such mask."""

    keepout: OccupancyGrid | None = None
    speed: SpeedLimits | None = None


@dataclass(frozen=True, eq=False)
class SpeedLimits:
    """A mask of speed limits; a cell of value v allows `base + multiplier * v` m/s, or percent of full speed."""

    grid: OccupancyGrid
    percent: bool
    base: float
    multiplier: float

    @property
    def limiting(self) -> bool:
        """Whether any cell limits anything."""
        return any(self.of(int(value), 1.0) is not None for value in np.unique(self.grid.cells))

    def at(self, pose: Pose2, full_speed: float) -> float | None:
        """The limit in m/s where the robot is, `full_speed` being the controller's; None for no limit."""
        value = int(self.grid.values_at(np.array([[pose.x, pose.y]]))[0])
        return self.of(value, full_speed)

    def along(self, points: Array, full_speed: float) -> Array:
        """The limits (n,) in m/s at points (n, 2); inf for none."""
        values = self.grid.values_at(points)
        limits = np.full(len(points), np.inf)
        for value in np.unique(values).tolist():
            limit = self.of(value, full_speed)
            limits[values == value] = np.inf if limit is None else limit
        return limits

    def of(self, value: int, full_speed: float) -> float | None:
        """The limit in m/s that a cell's value means; None for no limit.

        As in nav2's SpeedFilter, a limit of 0 is none, and neither is one below 0 or above 100 percent.
        """
        limit = self.base + self.multiplier * value
        if value <= 0 or limit <= 0 or (self.percent and limit > 100):
            return None
        return full_speed * limit / 100 if self.percent else limit


def in_keepout_mask(mask: OccupancyGrid, points: Array) -> npt.NDArray[np.bool_]:
    """Which of the points (n, 2) a keepout mask forbids; its lighter cells forbid nothing."""
    return np.asarray(mask.values_at(points) == OCCUPIED)


Block = tuple[int, int, int, int, int]
"""Column, row, width and height in cells, and the value of them all."""


@dataclass(frozen=True)
class MaskBlocks:
    """The cells of a mask that say something (1 … 100), as `blocks` that do not overlap.

    `resolution` in m per cell; `origin` is the corner of cell (0, 0), as for an OccupancyGrid.
    """

    resolution: float
    origin: Pose2 = Pose2(0.0, 0.0, 0.0)
    blocks: tuple[Block, ...] = ()

    @property
    def grid(self) -> OccupancyGrid:
        """The mask as cells again, as far as any say something."""
        width = max((column + width for column, _, width, _, _ in self.blocks), default=0)
        height = max((row + height for _, row, _, height, _ in self.blocks), default=0)
        cells = np.full((height, width), FREE, dtype=np.int8)
        for column, row, wide, high, value in self.blocks:
            cells[row : row + high, column : column + wide] = value
        return OccupancyGrid(cells, self.resolution, self.origin)

    @property
    def forbidden(self) -> Array:
        """The occupied blocks (n, 4): least x, least y, greatest x and greatest y in meters in the mask's own frame."""
        found = np.array([block[:4] for block in self.blocks if block[4] == OCCUPIED], dtype=np.float64).reshape(-1, 4)
        found[:, 2:] += found[:, :2]
        boxes: Array = found * self.resolution
        return boxes

    def seen_from(self, poses: Array) -> Array:
        """Poses (n, 3) of the map's frame in the mask's own."""
        local = self.origin.inverse().apply(poses[:, :2])
        return np.column_stack((local, poses[:, 2] - self.origin.yaw))


def mask_blocks(grid: OccupancyGrid) -> MaskBlocks:
    """The mask in blocks: runs of equal cells in a row, as long as the rows below have the same run."""
    blocks: list[Block] = []
    begun: dict[tuple[int, int, int], int] = {}
    for row in range(len(grid.cells) + 1):
        if 0 < row < len(grid.cells) and np.array_equal(grid.cells[row], grid.cells[row - 1]):
            continue
        runs = _runs(grid.cells[row]) if row < len(grid.cells) else []
        here = set(runs)
        for run in [run for run in begun if run not in here]:
            column, width, value = run
            blocks.append((column, begun[run], width, row - begun.pop(run), value))
        for run in runs:
            begun.setdefault(run, row)
    return MaskBlocks(float(grid.resolution), grid.origin, tuple(blocks))


def _runs(cells: npt.NDArray[np.int8]) -> list[tuple[int, int, int]]:
    """Column, width and value of each run of equal cells that say something."""
    edges = np.concatenate(([0], np.flatnonzero(np.diff(cells)) + 1, [len(cells)])).tolist()
    return [(a, b - a, int(cells[a])) for a, b in pairwise(edges) if b > a and cells[a] > FREE]


Filter = Literal["keepout", "speed"]


@dataclass(frozen=True, eq=False)
class Zones:
    """All that its filters say now: `keepout` are polygons it must not enter, `speed` such with a limit in m/s."""

    keepout: tuple[Polygon, ...] = ()
    speed: tuple[tuple[Polygon, float], ...] = ()
    masks: FilterMasks = field(default_factory=FilterMasks)


@dataclass(frozen=True)
class ZoneSwitch:
    """An order to switch a zone, or a whole filter with all its zones and its mask where `region` is None.

    `speed_limit` in m/s is for a zone of the speed filter; None keeps the one it has.
    """

    filter: Filter
    enabled: bool
    region: str | None = None
    speed_limit: float | None = None
