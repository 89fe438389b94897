"""What the sensors show on top of a map: cells that a lidar marked, and cells in which a depth camera saw something."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.sensing import Image, Scan
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.depth_layer import Heights, seen_through, shown
from simscen.stack.costmap.frame import Cells, Frame, Numbers
from simscen.stack.costmap.inflation_layer import Squared
from simscen.stack.costmap.obstacle_layer import crossed, hits, in_view
from simscen.stack.costmap.rolling import Cell, carried
from simscen.stack.costmap.static_layer import Mask

BESIDE_A_WALL = 2
"""Hits within one cell (squared distance 2) of a mapped wall are the wall itself: marking them would tell nothing."""
NONE: Numbers = np.zeros(0, dtype=np.int64)
NOWHERE: Mask = np.zeros((0, 0), dtype=bool)
Window = tuple[slice, slice]


class LiveLayer:
    """Marks and clears; a lidar never clears what a camera saw above or below it, nor a camera what a lidar sees."""

    def __init__(self, spec: CostmapSpec, inscribed: float, frame: Frame) -> None:
        self._spec, self._inscribed = spec, inscribed
        self._walls: Squared | None = None
        self._off_walls: Mask = np.zeros(0, dtype=bool)
        self.forget(frame)

    def forget(self, frame: Frame) -> None:
        """Begin with nothing, on these cells."""
        self._frame = frame
        self._scanned: Mask = np.zeros(frame.shape, dtype=bool)
        self._heights: Heights | None = None
        self._ground: Mask = NOWHERE
        self._marks: Numbers = NONE

    def forget_around(self, base: Pose2, metres: float) -> None:
        """Forget what lies so near to the robot along x and y."""
        here = self._frame.cell(base.x, base.y)
        window = self._frame.window(here, here, math.ceil(metres / self._frame.resolution))
        self._scanned[window] = False
        self._marks = np.flatnonzero(self._scanned)
        if self._heights is not None:
            self._heights[window] = np.nan

    def out_of_view(self, base: Pose2, metres: float, scans: list[tuple[Pose2, Scan]]) -> Cells:
        """The cells so near to the robot that are marked by a lidar and that none looked at in these scans."""
        here = self._frame.cell(base.x, base.y)
        window = self._frame.window(here, here, math.ceil(metres / self._frame.resolution))
        cells: Cells = np.argwhere(self._scanned[window]) + np.array((window[0].start, window[1].start))
        for place, scan in scans:
            cells = cells[~in_view(cells, self._frame, scan, place)]
        return cells

    def mark(self, cells: Cells) -> None:
        """A lidar has seen something here."""
        _set(self._scanned, cells, True)
        self._marks = np.flatnonzero(self._scanned)

    def roll(self, frame: Frame) -> None:
        """Go on in another window, with what lies in both."""
        before, self._frame = self._frame, frame
        self._scanned = carried(self._scanned, before, frame, False)
        self._marks = np.flatnonzero(self._scanned)
        if self._heights is not None:
            self._heights = carried(self._heights, before, frame, np.nan)
            self._ground = carried(self._ground, before, frame, False)

    def marked(self, window: Window = (slice(None), slice(None))) -> Mask:
        """The cells in which something is."""
        if self._heights is None:
            return self._scanned[window]
        both: Mask = self._scanned[window] | ~np.isnan(self._heights[window])
        return both

    @property
    def cells(self) -> Numbers:
        """The same by number."""
        return self._marks if self._heights is None else np.flatnonzero(self.marked())

    def on_scan(self, base: Pose2, scan: Scan, walls: Squared) -> Numbers:
        """Clear what the beams pass through, then mark what they hit; returns the cells that have changed."""
        spec, frame, scanned = self._spec, self._frame, self._scanned.reshape(-1)
        points, lidar = hits(scan, base, spec.obstacle_min_range, spec.obstacle_max_range)
        seen = frame.numbers(points, lidar, spec.obstacle_max_range)
        if walls is not self._walls:
            self._walls, self._off_walls = walls, walls > BESIDE_A_WALL
        marks, lost = self._marks, NONE
        if not len(marks):
            fresh = seen[self._off_walls.take(seen)]
            if not len(fresh):
                return NONE
        known = scanned.take(seen)
        fresh = seen[~known & self._off_walls.take(seen)]
        if len(marks):
            points = frame.points(marks)
            gone = marks[crossed(points, frame.resolution, scan, base, spec)]
            under = marks[np.abs(points - complex(base.x, base.y)) < self._inscribed]
            if len(gone) or len(under):
                scanned[gone] = False
                scanned[seen[known]] = True
                scanned[under] = False  # Nav2's footprint_clearing_enabled, for the inscribed circle
                kept = scanned.take(marks)
                lost, marks = marks[~kept], marks[kept]
        if len(fresh):
            scanned[fresh] = True
            marks = np.concatenate((marks, fresh))
        self._marks = marks
        return np.concatenate((lost, fresh)) if len(lost) else fresh

    def on_image(self, base: Pose2, image: Image, walls: Squared) -> Cells:
        """Clear what the camera sees through, then mark what it sees; returns the cells that may have changed."""
        if self._heights is None:
            self._heights = np.full(self._frame.shape, np.nan, dtype=np.float32)
            self._ground = np.zeros(self._frame.shape, dtype=bool)
        marked = np.argwhere(~np.isnan(self._heights))
        heights = self._heights[marked[:, 0], marked[:, 1]]
        gone = seen_through(marked, heights, self._frame, image, base, self._spec)
        gone |= self._under_robot(self._frame.centres(marked), base)
        _set(self._heights, marked[gone], np.nan)
        cells, heights, ground = shown(image, base, self._frame, self._spec, self._ground)
        _set(self._ground, ground, True)
        fresh = (_get(walls, cells) > BESIDE_A_WALL) & ~self._under_robot(self._frame.centres(cells), base)
        cells = cells[fresh]
        self._heights[cells[:, 0], cells[:, 1]] = heights[fresh]
        return np.concatenate((marked[gone], cells))

    def around(self, base: Pose2, mount: float) -> Window:
        """The cells that a sensor `mount` metres from the base can reach."""
        here = self._frame.cell(base.x, base.y)
        far = max(self._spec.raytrace_max_range, self._spec.obstacle_max_range) + mount
        return self._frame.window(here, here, math.ceil(far / self._frame.resolution) + 1)

    def _under_robot(self, points: Array, base: Pose2) -> Mask:
        """Nav2's footprint_clearing_enabled, for the inscribed circle and cells with these centres (n, 2)."""
        return np.asarray(np.hypot(points[:, 0] - base.x, points[:, 1] - base.y) < self._inscribed)


def _get(layer: npt.NDArray[Cell], cells: Cells) -> npt.NDArray[Cell]:
    return layer[cells[:, 0], cells[:, 1]]


def _set(layer: npt.NDArray[np.generic], cells: Cells, value: float) -> None:
    layer[cells[:, 0], cells[:, 1]] = value
