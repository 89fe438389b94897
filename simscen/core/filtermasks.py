"""Filter masks as nav2_costmap_2d's costmap filters read them: maps that say where not to go, and how fast."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.grid import OCCUPIED, OccupancyGrid

if TYPE_CHECKING:
    import numpy.typing as npt


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


def kept_out(mask: OccupancyGrid, points: Array) -> npt.NDArray[np.bool_]:
    """Which of the points (n, 2) a keepout mask forbids; its lighter cells forbid nothing."""
    return np.asarray(mask.values_at(points) == OCCUPIED)
