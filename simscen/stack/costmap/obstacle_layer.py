"""Obstacles that a lidar sees: nav2_costmap_2d's obstacle layer, without a loop over beams or cells.

Nav2 walks along every beam. Here only the cells that are marked now are asked whether a beam passes through them,
which is the same question and a hundred times fewer cells.
"""

import cmath
import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Image, Scan
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.model.costmaps import DenoiseLayer
from simscen.stack.costmap.depth_layer import Heights, project_depth_image, seen_through
from simscen.stack.costmap.grid_frame import Cell, CellIndices, Cells, GridFrame, shift_layer
from simscen.stack.costmap.inflation_layer import Squared
from simscen.stack.costmap.static_layer import Mask
from simscen.stack.localizers.beams import Plane, directions

RANGE_TOLERANCE_M = 1e-9
"""Margin before the end of the free part of a beam, within which cells are tested exactly."""


@dataclass(frozen=True, eq=False)
class ScanWithMovingHits(Scan):
    """A scan of which some beams, `moving` (n,), hit what will be somewhere else: it clears as any, and marks less."""

    moving: npt.NDArray[np.bool_] = field(kw_only=True)


def hit_points(scan: Scan, base: Pose2, nearest: float, farthest: float) -> tuple[Plane, complex]:
    """Return the points x + iy (n,) where beams hit static things `nearest` to `farthest` m away.

    And where the lidar is.
    """
    place = _place(scan, base)
    points: Plane = _ends(scan, nearest, farthest) * cmath.rect(1.0, base.yaw)
    points += place
    return points, place


@lru_cache(maxsize=2)
def _ends(scan: Scan, nearest: float, farthest: float) -> Plane:
    """Return the hits x + iy in the frame of the lidar, unrotated. Cached, since two costmaps use each scan."""
    ranges = scan.ranges
    use = (ranges >= max(scan.range_min, nearest)) & (ranges <= min(scan.range_max, farthest))
    if isinstance(scan, ScanWithMovingHits):
        use &= ~scan.moving
    beams = use.nonzero()[0]
    ends: Plane = ranges.take(beams) * directions(scan).take(beams)
    return ends


def _place(scan: Scan, base: Pose2) -> complex:
    """Return the position of the lidar in the map, x + iy."""
    return complex(base.x, base.y) + cmath.rect(1.0, base.yaw) * complex(scan.mount.x, scan.mount.y)


@lru_cache(maxsize=4)
def _shown_free(scan: Scan, farthest: float, inf_is_valid: bool) -> Array:
    """How far beams (n,) show free space: to their hits, or to `farthest`; nan and too near beams show 0.

    So do beams that meet nothing, unless `inf_is_valid`.
    """
    ranges = scan.ranges
    seen = np.where(ranges > scan.range_max, np.inf if inf_is_valid else 0.0, ranges)
    return np.where(seen >= scan.range_min, np.minimum(seen, farthest), 0.0)


def in_view(cells: Cells, frame: GridFrame, scan: Scan, base: Pose2) -> npt.NDArray[np.bool_]:
    """Which of the cells (n, 2) lie where the lidar looks, whatever it sees there."""
    lidar = base.compose(scan.mount)
    offset = frame.centers(cells) - np.array([lidar.x, lidar.y])
    bearing = np.arctan2(offset[:, 1], offset[:, 0])
    turned = (bearing - lidar.yaw - scan.angle_min) % (2 * math.pi)
    return np.asarray(turned <= abs(scan.angle_increment) * len(scan.ranges))


def crossed_cells(
    points: Plane, resolution: float, scan: Scan, base: Pose2, spec: CostmapSpec
) -> tuple[CellIndices, float]:
    """Return the indices of the cells with centers x + iy (n,) that a beam crosses before it hits anything.

    And how far the nearest of all centers, of which there is one, is from the lidar. A line crosses a square of
    half-width h when its distance from the center is at most h (|cos| + |sin|); each cell is tested against the beam
    nearest to its center, which crosses it if any does.
    """
    first, step, half = base.yaw + scan.mount.yaw + scan.angle_min, scan.angle_increment, resolution / 2
    seen = points - _place(scan, base)
    seen *= cmath.rect(1.0, -first)
    distance, bearing = np.abs(seen), np.arctan2(seen.imag, seen.real)
    nearest = distance.min().item()
    beam, free = _nearest_beams(bearing, scan, _shown_free(scan, spec.raytrace_max_range, spec.inf_is_valid))
    near = (distance * math.cos(step / 2) + half <= free).nonzero()[0]  # most lie behind what their beams hit
    if not len(near):
        return near, nearest
    distance, length = distance.take(near), free.take(near)
    wide = half / abs(math.sin(step / 2))  # nearer than this, beams lie so close that each cell is on one
    if spec.raytrace_min_range == 0.0 and (distance <= np.minimum(length - (half + RANGE_TOLERANCE_M), wide)).all():
        return near, nearest
    off = np.remainder(bearing[near] - beam[near] * step + math.pi, 2 * math.pi) - math.pi
    direction = first + bearing[near] - off
    reach = half * (np.abs(np.cos(direction)) + np.abs(np.sin(direction)))
    along = distance * np.cos(off)
    passed = (np.abs(distance * np.sin(off)) <= reach) & (along <= length - half) & (along >= spec.raytrace_min_range)
    return near[passed], nearest


def _nearest_beams(bearing: Array, scan: Scan, values: Array) -> tuple[CellIndices, Array]:
    """Return the beams nearest to directions (n,) relative to the first beam, and their values of `values`.

    The value is nan where there is no beam.
    """
    step, count = scan.angle_increment, len(values)
    turn = round(2 * math.pi / abs(step))
    even = abs(turn * abs(step) - 2 * math.pi) < 1e-6
    if even and turn == count:
        beam = np.rint(bearing / step).astype(np.int64)
        return beam, values.take(beam, mode="wrap")
    beam = np.rint((bearing % (2 * math.pi)) / step).astype(np.int64)
    if even:
        beam %= turn
    return beam, np.where((beam >= 0) & (beam < count), values.take(beam, mode="clip"), np.nan)


MAX_WALL_SQUARED_CELLS = 2
"""Hits within one cell (squared distance 2) of a mapped wall are the wall itself: marking them would tell nothing."""
NO_CELLS: CellIndices = np.zeros(0, dtype=np.int64)
NOWHERE: Mask = np.zeros((0, 0), dtype=bool)
Window = tuple[slice, slice]
WHOLE_GRID: Window = slice(None), slice(None)


class ObstacleLayer:
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
        self._marks: CellIndices = NO_CELLS

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

    def marked(self, window: Window = WHOLE_GRID) -> Mask:
        """Return the cells with a live obstacle."""
        if self._heights is None:
            return self._scanned[window]
        both: Mask = self._scanned[window] | ~np.isnan(self._heights[window])
        return both

    @property
    def cells(self) -> CellIndices:
        """Numbers of the cells with a live obstacle."""
        return self._marks if self._heights is None else np.flatnonzero(self.marked())

    @property
    def count(self) -> int:
        """How many they are; some are listed twice, as two beams hit them at once."""
        return len(set(self._marks.tolist())) if self._heights is None else int(np.count_nonzero(self.marked()))

    def on_scan(self, base: Pose2, scan: Scan, walls: Squared | None) -> CellIndices:
        """Clear what the beams pass through, then mark what they hit; returns the cells that have changed.

        `walls` are distances to what the map shows; None where it shows nothing.
        """
        spec, frame, scanned = self._spec, self._frame, self._scanned.reshape(-1)
        points, lidar = hit_points(scan, base, spec.obstacle_min_range, spec.obstacle_max_range)
        seen = frame.numbers(points, lidar, spec.obstacle_max_range)
        if not len(self._marks):
            fresh, lost = self._off(walls, seen), NO_CELLS
        else:
            known = scanned.take(seen)
            fresh, lost = self._off(walls, seen[~known]), self._cleared(base, scan, seen[known])
        if not len(fresh):
            return lost
        scanned[fresh] = True
        self._marks = np.concatenate((self._marks, fresh))
        return np.concatenate((lost, fresh)) if len(lost) else fresh

    def _off(self, walls: Squared | None, seen: CellIndices) -> CellIndices:
        """Those of the cells that are not beside a wall."""
        if walls is None:
            return seen
        if walls is not self._walls:
            self._walls, self._off_walls = walls, walls > MAX_WALL_SQUARED_CELLS
        off: CellIndices = seen[self._off_walls.take(seen)]
        return off

    def _cleared(self, base: Pose2, scan: Scan, seen: CellIndices) -> CellIndices:
        """Clear what the beams pass through but those cells that were `seen` again; the cells that were marked."""
        marks, frame, scanned = self._marks, self._frame, self._scanned.reshape(-1)
        points = frame.points(marks)
        gone, nearest = crossed_cells(points, frame.resolution, scan, base, self._spec)
        beneath = nearest < self._inscribed + math.hypot(scan.mount.x, scan.mount.y)
        if not beneath and not len(gone):
            return NO_CELLS
        scanned[marks[gone]] = False
        scanned[seen] = True
        if beneath:
            under = np.abs(points - complex(base.x, base.y)) < self._inscribed
            scanned[marks[under]] = False  # Nav2's footprint_clearing_enabled, for the inscribed circle
        kept = scanned.take(marks)
        if kept.all():
            return NO_CELLS
        self._marks = marks[kept]
        lost: CellIndices = marks[~kept]
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
        cells, heights, ground = project_depth_image(image, base, self._frame, self._spec, self._ground)
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


def remove_small_groups(marked: Mask, walls: Mask, spec: DenoiseLayer) -> Mask:
    """Return the marked cells (rows, columns) without groups smaller than `minimal_group_size`.

    Cells of walls, which are no noise, count as members of a group and stay what they are.
    """
    from scipy.ndimage import label

    if spec.minimal_group_size <= 1 or not marked.any():
        return marked
    corners = 1 if spec.group_connectivity_type == 8 else 0
    joined = np.array([[corners, 1, corners], [1, 1, 1], [corners, 1, corners]])
    groups, _ = label(marked | walls, joined)
    sizes = np.bincount(groups.ravel())
    kept: Mask = marked & (sizes[groups] >= spec.minimal_group_size)
    return kept
