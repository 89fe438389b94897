"""Obstacle layer: cells that lidars and depth cameras mark and clear, as in nav2_costmap_2d.

Nav2 traces each beam through the grid. Here, each marked cell is tested for a beam that crosses the cell, which is
faster.
"""

import cmath
import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.messages.sensor_data import Image, Scan
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.model.costmaps import DenoiseLayer
from simscen.stack.costmap.depth_layer import Heights, is_seen_through, project_depth_image
from simscen.stack.costmap.distance_transform import Squared
from simscen.stack.costmap.grid_frame import CellIndices, Cells, GridFrame, Mask, shift_layer
from simscen.stack.localizers.beams import ComplexPoints, directions

RANGE_TOLERANCE_M = 1e-9
"""Rounding error allowed for ranges."""


@dataclass(frozen=True, eq=False)
class ScanWithMovingHits(Scan):
    """Scan with a mask `moving` (n,) of the beams that hit moving obstacles. These beams only clear cells."""

    moving: npt.NDArray[np.bool_] = field(kw_only=True)


def hit_points(scan: Scan, base: Pose2, nearest: float, farthest: float) -> tuple[ComplexPoints, complex]:
    """Return the hits x + iy (n,) of beams between `nearest` and `farthest` m, and the position of the lidar.

    `base` is the pose of the robot. Hits on moving obstacles are left out.
    """
    lidar = _lidar_position(scan, base)
    points: ComplexPoints = _hit_offsets(scan, nearest, farthest) * cmath.rect(1.0, base.yaw)
    points += lidar
    return points, lidar


@lru_cache(maxsize=2)
def _hit_offsets(scan: Scan, nearest: float, farthest: float) -> ComplexPoints:
    """Return the hits x + iy (n,) relative to the position of the lidar, in the orientation of the base. Cached."""
    ranges = scan.ranges
    is_valid = (ranges >= max(scan.range_min, nearest)) & (ranges <= min(scan.range_max, farthest))
    if isinstance(scan, ScanWithMovingHits):
        is_valid &= ~scan.moving
    beams = is_valid.nonzero()[0]
    ends: ComplexPoints = ranges.take(beams) * directions(scan).take(beams)
    return ends


def _lidar_position(scan: Scan, base: Pose2) -> complex:
    """Return the position x + iy of the lidar in the frame of the pose `base`."""
    return complex(base.x, base.y) + cmath.rect(1.0, base.yaw) * complex(scan.mount.x, scan.mount.y)


@lru_cache(maxsize=4)
def _free_lengths(scan: Scan, farthest: float, inf_is_valid: bool) -> Array:
    """Return for each beam (n,) the free length in m up to the hit, at most `farthest`; 0 if the range is invalid.

    With `inf_is_valid`, beams without a hit are valid.
    """
    ranges = scan.ranges
    lengths = np.where(ranges > scan.range_max, np.inf if inf_is_valid else 0.0, ranges)
    return np.where(lengths >= scan.range_min, np.minimum(lengths, farthest), 0.0)


def in_view(cells: Cells, frame: GridFrame, scan: Scan, base: Pose2) -> npt.NDArray[np.bool_]:
    """Return which of the cells (n, 2) are in the angular field of view of the lidar, regardless of obstacles."""
    lidar = base.compose(scan.mount)
    offset = frame.centers(cells) - np.array([lidar.x, lidar.y])
    bearing = np.arctan2(offset[:, 1], offset[:, 0])
    step = scan.angle_increment  # the outer beams see half a step beyond their directions
    turned = np.remainder(bearing - lidar.yaw - scan.angle_min + step / 2, math.copysign(2 * math.pi, step))
    return np.asarray(np.abs(turned) <= abs(step) * len(scan.ranges))


def crossed_cells(
    points: ComplexPoints, resolution: float, scan: Scan, base: Pose2, spec: CostmapSpec
) -> tuple[CellIndices, float]:
    """Return the cells that beams cross before their hits, and the distance in m from the lidar to the nearest center.

    `points` x + iy (n,) are the centers of at least one cell. Cells in the result are indices into `points`. Each cell
    is tested only against the beam that passes nearest to its center.
    """
    first, step, half = base.yaw + scan.mount.yaw + scan.angle_min, scan.angle_increment, resolution / 2
    relative = points - _lidar_position(scan, base)
    relative *= cmath.rect(1.0, -first)
    distance, bearing = np.abs(relative), np.arctan2(relative.imag, relative.real)
    nearest = distance.min().item()
    beam, free_length = _nearest_beams(bearing, scan, _free_lengths(scan, spec.raytrace_max_range, spec.inf_is_valid))
    # Most cells are behind the hits of their beams.
    in_front = (distance * math.cos(step / 2) + half <= free_length).nonzero()[0]
    if not len(in_front):
        return in_front, nearest
    distance, free_length = distance.take(in_front), free_length.take(in_front)
    # Up to this distance, neighboring beams are so close that one of them crosses each cell.
    dense_distance = half / math.sin(min(abs(step), math.pi) / 2)
    if (
        spec.raytrace_min_range == 0.0
        and (distance <= np.minimum(free_length - (half + RANGE_TOLERANCE_M), dense_distance)).all()
    ):
        return in_front, nearest
    beam_offset = wrap_array(bearing[in_front] - beam[in_front] * step)
    direction = first + bearing[in_front] - beam_offset
    # A line crosses a square of half-width h if its distance from the center is at most h (|cos| + |sin|).
    reach = half * (np.abs(np.cos(direction)) + np.abs(np.sin(direction)))
    along = distance * np.cos(beam_offset)
    is_crossed = (
        (np.abs(distance * np.sin(beam_offset)) <= reach)
        & (along <= free_length - half)
        & (along >= spec.raytrace_min_range)
    )
    return in_front[is_crossed], nearest


def _nearest_beams(bearing: Array, scan: Scan, values: Array) -> tuple[CellIndices, Array]:
    """Return the indices (n,) of the beams nearest to these bearings (n,), and the `values` (n,) of these beams.

    Bearings are relative to the first beam. The value is nan for bearings outside the field of view.
    """
    step, count = scan.angle_increment, len(values)
    beams_per_turn = round(2 * math.pi / abs(step))
    divides_turn = abs(beams_per_turn * abs(step) - 2 * math.pi) < 1e-6
    if divides_turn and beams_per_turn == count:
        beam = np.rint(bearing / step).astype(np.int64)
        return beam, values.take(beam, mode="wrap")
    beam = np.rint(np.remainder(bearing, math.copysign(2 * math.pi, step)) / step).astype(np.int64)
    if divides_turn:
        beam %= beams_per_turn
    return beam, np.where((beam >= 0) & (beam < count), values.take(beam, mode="clip"), np.nan)


WALL_DISTANCE_SQUARED_CELLS = 2
"""Squared distance from a mapped wall up to which a hit is treated as a hit on the wall, and not marked."""
NO_CELLS: CellIndices = np.zeros(0, dtype=np.int64)
EMPTY_MASK: Mask = np.zeros((0, 0), dtype=bool)
Window = tuple[slice, slice]
"""Rows and columns of a part of the grid."""
WHOLE_GRID: Window = slice(None), slice(None)


class ObstacleLayer:
    """Live obstacles: cells that sensors have marked. Lidars do not clear marks of depth cameras, and vice versa."""

    def __init__(self, spec: CostmapSpec, inscribed: float, frame: GridFrame) -> None:
        self._spec, self._inscribed = spec, inscribed
        self._walls: Squared | None = None
        self._is_off_walls: Mask = np.zeros(0, dtype=bool)
        self.reset(frame)

    def reset(self, frame: GridFrame) -> None:
        """Remove all marks, and use this grid from now on."""
        self._frame = frame
        self._scanned: Mask = np.zeros(frame.shape, dtype=bool)
        """Cells that lidars have marked."""
        self._scanned_cells: CellIndices = NO_CELLS
        """Flat indices of the cells in `_scanned`. A cell may occur twice."""
        self._heights: Heights | None = None
        """Heights of the obstacles that depth cameras have marked, nan elsewhere; None before the first image."""
        self._ground: Mask = EMPTY_MASK
        """Cells in which a depth camera has seen the ground."""

    def clear_around(self, base: Pose2, meters: float) -> None:
        """Remove the marks within `meters` of the robot along x and y."""
        center = self._frame.cell(base.x, base.y)
        window = self._frame.window(center, center, math.ceil(meters / self._frame.resolution))
        self._scanned[window] = False
        self._scanned_cells = np.flatnonzero(self._scanned)
        if self._heights is not None:
            self._heights[window] = np.nan

    def cells_out_of_view(self, base: Pose2, meters: float, scans: list[tuple[Pose2, Scan]]) -> Cells:
        """Return the cells (n, 2) with marks of a lidar that are outside the field of view of all `scans`.

        The result contains only cells within `meters` of the robot along x and y. `scans` are pairs (pose of the robot,
        scan).
        """
        center = self._frame.cell(base.x, base.y)
        window = self._frame.window(center, center, math.ceil(meters / self._frame.resolution))
        cells: Cells = np.argwhere(self._scanned[window]) + np.array((window[0].start, window[1].start))
        for pose, scan in scans:
            cells = cells[~in_view(cells, self._frame, scan, pose)]
        return cells

    def mark(self, cells: Cells) -> None:
        """Mark cells (n, 2) as obstacles seen by a lidar."""
        _set_values(self._scanned, cells, True)
        self._scanned_cells = np.flatnonzero(self._scanned)

    def roll(self, frame: GridFrame) -> None:
        """Use another window of the same size, and keep the marks that are in both windows."""
        old_frame, self._frame = self._frame, frame
        self._scanned = shift_layer(self._scanned, old_frame, frame, False)
        self._scanned_cells = np.flatnonzero(self._scanned)
        if self._heights is not None:
            self._heights = shift_layer(self._heights, old_frame, frame, np.nan)
            self._ground = shift_layer(self._ground, old_frame, frame, False)

    def marked(self, window: Window = WHOLE_GRID) -> Mask:
        """Return which cells of a window have a live obstacle."""
        if self._heights is None:
            return self._scanned[window]
        marked: Mask = self._scanned[window] | ~np.isnan(self._heights[window])
        return marked

    @property
    def cells(self) -> CellIndices:
        """Flat indices of the cells with a live obstacle. A cell may occur twice."""
        return self._scanned_cells if self._heights is None else np.flatnonzero(self.marked())

    @property
    def count(self) -> int:
        """Number of cells with a live obstacle."""
        return len(set(self._scanned_cells.tolist())) if self._heights is None else int(np.count_nonzero(self.marked()))

    def on_scan(self, base: Pose2, scan: Scan, walls: Squared | None) -> CellIndices:
        """Clear marks that beams cross or that are under the robot. Then mark the hits. Return the changed cells.

        `walls` (rows, columns) are squared distances in cells to mapped walls; None without walls.
        """
        spec, frame, scanned = self._spec, self._frame, self._scanned.reshape(-1)
        points, lidar = hit_points(scan, base, spec.obstacle_min_range, spec.obstacle_max_range)
        hits = frame.indices_of(points, lidar, spec.obstacle_max_range)
        if not len(self._scanned_cells):
            marked, cleared = self._without_walls(walls, hits), NO_CELLS
        else:
            was_marked = scanned.take(hits)
            marked, cleared = self._without_walls(walls, hits[~was_marked]), self._clear(base, scan, hits[was_marked])
        if not len(marked):
            return cleared
        scanned[marked] = True
        self._scanned_cells = np.concatenate((self._scanned_cells, marked))
        return np.concatenate((cleared, marked)) if len(cleared) else marked

    def _without_walls(self, walls: Squared | None, cells: CellIndices) -> CellIndices:
        """Return the `cells` that are neither on nor next to a wall."""
        if walls is None:
            return cells
        if walls is not self._walls:
            self._walls, self._is_off_walls = walls, walls > WALL_DISTANCE_SQUARED_CELLS
        remaining: CellIndices = cells[self._is_off_walls.take(cells)]
        return remaining

    def _clear(self, base: Pose2, scan: Scan, hits: CellIndices) -> CellIndices:
        """Clear marked cells that beams cross, except `hits`, or that are under the robot. Return the cleared cells."""
        marks, frame, scanned = self._scanned_cells, self._frame, self._scanned.reshape(-1)
        points = frame.points(marks)
        crossed, nearest = crossed_cells(points, frame.resolution, scan, base, self._spec)
        may_be_under_robot = nearest < self._inscribed + math.hypot(scan.mount.x, scan.mount.y)
        if not may_be_under_robot and not len(crossed):
            return NO_CELLS
        scanned[marks[crossed]] = False
        scanned[hits] = True
        if may_be_under_robot:
            is_under_robot = np.abs(points - complex(base.x, base.y)) < self._inscribed
            scanned[marks[is_under_robot]] = False  # as Nav2's footprint_clearing_enabled, with the inscribed circle
        remains = scanned.take(marks)
        if remains.all():
            return NO_CELLS
        self._scanned_cells = marks[remains]
        cleared: CellIndices = marks[~remains]
        return cleared

    def on_image(self, base: Pose2, image: Image, walls: Squared) -> Cells:
        """Clear cells that the camera sees through or that are under the robot. Then mark the obstacles in the image.

        Obstacles on or next to a mapped wall, or under the robot, are not marked. Return the changed cells (n, 2).
        `walls` (rows, columns) are squared distances in cells to mapped walls.
        """
        if self._heights is None:
            self._heights = np.full(self._frame.shape, np.nan, dtype=np.float32)
            self._ground = np.zeros(self._frame.shape, dtype=bool)
        marked = np.argwhere(~np.isnan(self._heights))
        heights = self._heights[marked[:, 0], marked[:, 1]]
        is_cleared = is_seen_through(marked, heights, self._frame, image, base, self._spec)
        is_cleared |= self._is_under_robot(self._frame.centers(marked), base)
        _set_values(self._heights, marked[is_cleared], np.nan)
        cells, heights, ground = project_depth_image(image, base, self._frame, self._spec, self._ground)
        _set_values(self._ground, ground, True)
        is_off_walls = walls[cells[:, 0], cells[:, 1]] > WALL_DISTANCE_SQUARED_CELLS
        new = is_off_walls & ~self._is_under_robot(self._frame.centers(cells), base)
        cells = cells[new]
        self._heights[cells[:, 0], cells[:, 1]] = heights[new]
        return np.concatenate((marked[is_cleared], cells))

    def window_around_robot(self, base: Pose2, mount_distance: float) -> Window:
        """Return the window in range of a sensor that is mounted `mount_distance` m away from the base."""
        center = self._frame.cell(base.x, base.y)
        reach = max(self._spec.raytrace_max_range, self._spec.obstacle_max_range) + mount_distance
        return self._frame.window(center, center, math.ceil(reach / self._frame.resolution) + 1)

    def _is_under_robot(self, points: Array, base: Pose2) -> Mask:
        """Return which points (n, 2) are in the inscribed circle of the robot."""
        return np.asarray(np.hypot(points[:, 0] - base.x, points[:, 1] - base.y) < self._inscribed)


def _set_values(layer: npt.NDArray[np.generic], cells: Cells, value: float) -> None:
    layer[cells[:, 0], cells[:, 1]] = value


def remove_small_groups(marked: Mask, walls: Mask, spec: DenoiseLayer) -> Mask:
    """Return the marked cells (rows, columns) without connected groups of fewer than `minimal_group_size` cells.

    Cells of walls count toward the size of a group, but are not part of the result.
    """
    from scipy.ndimage import label

    if spec.minimal_group_size <= 1 or not marked.any():
        return marked
    corners = 1 if spec.group_connectivity_type == 8 else 0
    structure = np.array([[corners, 1, corners], [1, 1, 1], [corners, 1, corners]])
    groups, _ = label(marked | walls, structure)
    sizes = np.bincount(groups.ravel())
    remains: Mask = marked & (sizes[groups] >= spec.minimal_group_size)
    return remains
