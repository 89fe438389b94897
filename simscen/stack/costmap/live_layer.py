"""Live obstacles of a costmap: cells marked by lidars and by depth cameras."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Image, Scan
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.depth_layer import Heights, seen_through, shown
from simscen.stack.costmap.grid_frame import Cell, Cells, GridFrame, Numbers, shift_layer
from simscen.stack.costmap.inflation_layer import Squared
from simscen.stack.costmap.obstacle_layer import crossed_cells, hit_points, in_view
from simscen.stack.costmap.static_layer import Mask

MAX_WALL_SQUARED_CELLS = 2
"""Hits within one cell (squared distance 2) of a mapped wall are the wall itself: marking them would tell nothing."""
NONE: Numbers = np.zeros(0, dtype=np.int64)
NOWHERE: Mask = np.zeros((0, 0), dtype=bool)
Window = tuple[slice, slice]
EVERYWHERE: Window = slice(None), slice(None)


class LiveLayer:
    """Marks and clears; a lidar never clears what a camera saw above or below it, nor a camera what a lidar sees."""

    def __init__(self, spec: CostmapSpec, inscribed: float, frame: GridFrame) -> None:
        self._spec, self._inscribed = spec, inscribed
        self._walls: Squared | None = None
        self._off_walls: Mask = np.zeros(0, dtype=bool)
        self.forget(frame)

    def forget(self, frame: GridFrame) -> None:
        """Begin with nothing, on these cells."""
        self._frame = frame
        self._scanned: Mask = np.zeros(frame.shape, dtype=bool)
        self._heights: Heights | None = None
        self._ground: Mask = NOWHERE
        self._marks: Numbers = NONE

    def forget_around(self, base: Pose2, meters: float) -> None:
        """Forget what lies so near to the robot along x and y."""
        here = self._frame.cell(base.x, base.y)
        window = self._frame.window(here, here, math.ceil(meters / self._frame.resolution))
        self._scanned[window] = False
        self._marks = np.flatnonzero(self._scanned)
        if self._heights is not None:
            self._heights[window] = np.nan

    def out_of_view(self, base: Pose2, meters: float, scans: list[tuple[Pose2, Scan]]) -> Cells:
        """Return the cells near the robot that are marked by a lidar but not visible in these scans."""
        here = self._frame.cell(base.x, base.y)
        window = self._frame.window(here, here, math.ceil(meters / self._frame.resolution))
        cells: Cells = np.argwhere(self._scanned[window]) + np.array((window[0].start, window[1].start))
        for place, scan in scans:
            cells = cells[~in_view(cells, self._frame, scan, place)]
        return cells

    def mark(self, cells: Cells) -> None:
        """Mark cells as obstacles seen by a lidar."""
        _set(self._scanned, cells, True)
        self._marks = np.flatnonzero(self._scanned)

    def roll(self, frame: GridFrame) -> None:
        """Go on in another window, with what lies in both."""
        before, self._frame = self._frame, frame
        self._scanned = shift_layer(self._scanned, before, frame, False)
        self._marks = np.flatnonzero(self._scanned)
        if self._heights is not None:
            self._heights = shift_layer(self._heights, before, frame, np.nan)
            self._ground = shift_layer(self._ground, before, frame, False)

    def marked(self, window: Window = EVERYWHERE) -> Mask:
        """Return the cells with a live obstacle."""
        if self._heights is None:
            return self._scanned[window]
        both: Mask = self._scanned[window] | ~np.isnan(self._heights[window])
        return both

    @property
    def cells(self) -> Numbers:
        """Numbers of the cells with a live obstacle."""
        return self._marks if self._heights is None else np.flatnonzero(self.marked())

    @property
    def count(self) -> int:
        """How many they are; some are listed twice, as two beams hit them at once."""
        return len(set(self._marks.tolist())) if self._heights is None else int(np.count_nonzero(self.marked()))

    def on_scan(self, base: Pose2, scan: Scan, walls: Squared | None) -> Numbers:
        """Clear what the beams pass through, then mark what they hit; returns the cells that have changed.

        `walls` are distances to what the map shows; None where it shows nothing.
        """
        spec, frame, scanned = self._spec, self._frame, self._scanned.reshape(-1)
        points, lidar = hit_points(scan, base, spec.obstacle_min_range, spec.obstacle_max_range)
        seen = frame.numbers(points, lidar, spec.obstacle_max_range)
        if not len(self._marks):
            fresh, lost = self._off(walls, seen), NONE
        else:
            known = scanned.take(seen)
            fresh, lost = self._off(walls, seen[~known]), self._cleared(base, scan, seen[known])
        if not len(fresh):
            return lost
        scanned[fresh] = True
        self._marks = np.concatenate((self._marks, fresh))
        return np.concatenate((lost, fresh)) if len(lost) else fresh

    def _off(self, walls: Squared | None, seen: Numbers) -> Numbers:
        """Those of the cells that are not beside a wall."""
        if walls is None:
            return seen
        if walls is not self._walls:
            self._walls, self._off_walls = walls, walls > MAX_WALL_SQUARED_CELLS
        off: Numbers = seen[self._off_walls.take(seen)]
        return off

    def _cleared(self, base: Pose2, scan: Scan, seen: Numbers) -> Numbers:
        """Clear what the beams pass through but those cells that were `seen` again; the cells that were marked."""
        marks, frame, scanned = self._marks, self._frame, self._scanned.reshape(-1)
        points = frame.points(marks)
        gone, nearest = crossed_cells(points, frame.resolution, scan, base, self._spec)
        beneath = nearest < self._inscribed + math.hypot(scan.mount.x, scan.mount.y)
        if not beneath and not len(gone):
            return NONE
        scanned[marks[gone]] = False
        scanned[seen] = True
        if beneath:
            under = np.abs(points - complex(base.x, base.y)) < self._inscribed
            scanned[marks[under]] = False  # Nav2's footprint_clearing_enabled, for the inscribed circle
        kept = scanned.take(marks)
        if kept.all():
            return NONE
        self._marks = marks[kept]
        lost: Numbers = marks[~kept]
        return lost

    def on_image(self, base: Pose2, image: Image, walls: Squared) -> Cells:
        """Clear what the camera sees through, then mark what it sees; returns the cells that may have changed."""
        if self._heights is None:
            self._heights = np.full(self._frame.shape, np.nan, dtype=np.float32)
            self._ground = np.zeros(self._frame.shape, dtype=bool)
        marked = np.argwhere(~np.isnan(self._heights))
        heights = self._heights[marked[:, 0], marked[:, 1]]
        gone = seen_through(marked, heights, self._frame, image, base, self._spec)
        gone |= self._under_robot(self._frame.centers(marked), base)
        _set(self._heights, marked[gone], np.nan)
        cells, heights, ground = shown(image, base, self._frame, self._spec, self._ground)
        _set(self._ground, ground, True)
        fresh = (_get(walls, cells) > MAX_WALL_SQUARED_CELLS) & ~self._under_robot(self._frame.centers(cells), base)
        cells = cells[fresh]
        self._heights[cells[:, 0], cells[:, 1]] = heights[fresh]
        return np.concatenate((marked[gone], cells))

    def around(self, base: Pose2, mount: float) -> Window:
        """Return the cells in reach of a sensor `mount` m from the base."""
        here = self._frame.cell(base.x, base.y)
        far = max(self._spec.raytrace_max_range, self._spec.obstacle_max_range) + mount
        return self._frame.window(here, here, math.ceil(far / self._frame.resolution) + 1)

    def _under_robot(self, points: Array, base: Pose2) -> Mask:
        """Nav2's footprint_clearing_enabled, for the inscribed circle and cells with these centers (n, 2)."""
        return np.asarray(np.hypot(points[:, 0] - base.x, points[:, 1] - base.y) < self._inscribed)


def _get(layer: npt.NDArray[Cell], cells: Cells) -> npt.NDArray[Cell]:
    return layer[cells[:, 0], cells[:, 1]]


def _set(layer: npt.NDArray[np.generic], cells: Cells, value: float) -> None:
    layer[cells[:, 0], cells[:, 1]] = value
