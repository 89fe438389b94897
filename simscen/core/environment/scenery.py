"""Visible parts of the world for replay pages and pictures of a run: objects, places, ramps, floors, zones, map."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from simscen.core.environment.costmap_filters import Filter, MaskBlocks
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Polygon, Pose2


@dataclass(frozen=True)
class MovableObject:
    """Movable object at its start pose.

    `outlines` are the outlines of the object's parts, seen from above, in the frame of the object. `closed` and
    `opened` are the poses of a door panel; None for other objects. `mass` is in kg; 0 if the object cannot be pushed.
    """

    name: str
    pose: Pose2
    outlines: tuple[Polygon, ...]
    closed: Pose2 | None = None
    opened: Pose2 | None = None
    mass: float = 0.0


@dataclass(frozen=True)
class DrivableSurface:
    """Surface on which wheels can roll: a ramp, a sill, or a platform.

    `height` is the height of the highest point in m. `uphill` is the slope along x and y in m per m.
    """

    name: str
    outline: Polygon
    height: float
    uphill: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class FrictionRegion:
    """Region with a floor friction other than the default of 1 (rubber on dry concrete) at the start of the run."""

    region: str
    outline: Polygon
    friction: float


@dataclass(frozen=True)
class FilterZone:
    """Zone or mask of a costmap filter at the start of the run.

    A zone has a `region` (its name) and an `outline`; a mask has `cells`. `speed_limit` is in m/s; 0 for none. `robot`
    is the name of the robot that uses the filter.
    """

    filter: Filter
    region: str = ""
    outline: Polygon = ()
    speed_limit: float = 0.0
    cells: MaskBlocks | None = None
    robot: str = ""


@dataclass(frozen=True)
class CompressedGrid:
    """Occupancy grid with compressed cells, which can be written as JSON.

    `width` and `height` are in cells, and `resolution` is in m per cell. `origin` is the pose of the corner of cell
    (0, 0) in the map frame. `data` contains the int8 cells row by row, compressed by zlib and encoded in base64.
    """

    width: int
    height: int
    resolution: float
    origin: Pose2
    data: str

    @classmethod
    def of(cls, grid: OccupancyGrid) -> CompressedGrid:
        """Return the grid in compressed form."""
        packed = zlib.compress(np.ascontiguousarray(grid.cells).tobytes(), 9)
        height, width = grid.shape
        return cls(width, height, grid.resolution, grid.origin, base64.b64encode(packed).decode("ascii"))

    @property
    def grid(self) -> OccupancyGrid:
        """The uncompressed grid. Raises ValueError if `data` is damaged."""
        try:
            cells = np.frombuffer(zlib.decompress(base64.b64decode(self.data)), dtype=np.int8)
        except zlib.error as error:
            raise ValueError(f"the cells of the map are damaged: {error}") from None
        return OccupancyGrid(cells.reshape(self.height, self.width), self.resolution, self.origin)


@dataclass(frozen=True)
class Scenery:
    """Visible parts of the world at the start of a run.

    `places` are named poses, and `things` are movable objects. `ground` contains ramps and other drivable surfaces,
    `floors` the regions with changed friction, and `zones` the zones and masks of costmap filters. `map` is the map of
    the world; None if it equals the maps of all robots, which are in the header of the log, too.
    """

    places: Mapping[str, Pose2] = field(default_factory=dict)
    things: tuple[MovableObject, ...] = ()
    ground: tuple[DrivableSurface, ...] = ()
    floors: tuple[FrictionRegion, ...] = ()
    zones: tuple[FilterZone, ...] = ()
    map: CompressedGrid | None = None
