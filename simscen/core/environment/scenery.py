"""What there was to see: the part of a world that a run's messages do not tell, for those who show it."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.environment.costmap_filters import Filter, MaskBlocks
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2

if TYPE_CHECKING:
    from simscen.core.environment.world_model import Polygon
else:
    Polygon = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class MovableObject:
    """Something of the world that can move: where it is at the start, and what it looks like from above.

    `outlines` are in its own frame; of a door, whose frame is at its hinge, `closed` and `opened` are where its panel
    can be. `mass` in kg; 0 for what nothing can push.
    """

    name: str
    pose: Pose2
    outlines: tuple[Polygon, ...]
    closed: Pose2 | None = None
    opened: Pose2 | None = None
    mass: float = 0.0


@dataclass(frozen=True)
class DrivableSurface:
    """Something that wheels may roll over: a ramp, a sill, a platform.

    `height` is that of its highest point in m; `uphill` how much it rises for each meter of x and of y, zeros where
    its top is level.
    """

    name: str
    outline: Polygon
    height: float
    uphill: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class FrictionRegion:
    """A region whose floor has another friction than 1, that of dry concrete, from the start."""

    region: str
    outline: Polygon
    friction: float


@dataclass(frozen=True)
class FilterZone:
    """A zone of a costmap filter as the stack of `robot` has it from the start; `speed_limit` in m/s, 0 for none.

    One of a filter mask has no region, and `cells` in place of an outline.
    """

    filter: Filter
    region: str = ""
    outline: Polygon = ()
    speed_limit: float = 0.0
    cells: MaskBlocks | None = None
    robot: str = ""


@dataclass(frozen=True)
class CompressedGrid:
    """An occupancy grid as plain data: `data` is its int8 cells, row by row, compressed by zlib, in base64."""

    width: int
    height: int
    resolution: float
    origin: Pose2
    data: str

    @classmethod
    def of(cls, grid: OccupancyGrid) -> CompressedGrid:
        """The grid packed."""
        packed = zlib.compress(np.ascontiguousarray(grid.cells).tobytes(), 9)
        height, width = grid.shape
        return cls(width, height, grid.resolution, grid.origin, base64.b64encode(packed).decode("ascii"))

    @property
    def grid(self) -> OccupancyGrid:
        """The grid again. Raises ValueError where it is damaged."""
        try:
            cells = np.frombuffer(zlib.decompress(base64.b64decode(self.data)), dtype=np.int8)
        except zlib.error as error:
            raise ValueError(f"its cells are damaged: {error}") from None
        return OccupancyGrid(cells.reshape(self.height, self.width), self.resolution, self.origin)


@dataclass(frozen=True)
class Scenery:
    """The world at the start of a run. `map` is how it is, where that is not the map that the robot was given."""

    places: Mapping[str, Pose2] = field(default_factory=dict)
    things: tuple[MovableObject, ...] = ()
    ground: tuple[DrivableSurface, ...] = ()
    floors: tuple[FrictionRegion, ...] = ()
    zones: tuple[FilterZone, ...] = ()
    map: CompressedGrid | None = None
