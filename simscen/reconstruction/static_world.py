"""Static world of a recorded drive: expected ranges, distances to walls, and a map built from scans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import distance_transform_edt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Array, Pose2
from simscen.reconstruction.drive.gaps import scans_with_pose
from simscen.reconstruction.drive.motion_steps import MAX_STEP_M, STEP_S
from simscen.reconstruction.drive.recorded_drive import (
    Indices,
    Mask,
    RecordedDrive,
    Scans,
    TimedValues,
)
from simscen.worlds.extent import placed_solids
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.occupancy_map import draw_map, walls_from_map
from simscen.worlds.raycasting.ray_scene import RayScene

MAP_WALL_HEIGHT_M = 1.0
"""Height of walls that `world_from_map` builds from the occupied cells of a map."""
UNMAPPED_DISTANCE_M = 1e3
"""Result of `StaticWorld.distance_to_walls` for points outside of the map, and for a map without occupied cells."""
RESOLUTION_M = 0.05
"""Cell size of the map that is built from scans."""
MAX_CELLS = 100_000_000
"""Maximum number of cells of the map that is built from scans."""
MARGIN_M = 1.0
"""Distance between the border of the map and all hits and poses."""
NO_SCANS_MARGIN_M = 5.0
"""Distance between the border of the map and all poses, for a drive without scans."""
TARGET_SCANS = 1500
"""Minimum number of scans that are used from a long drive. At most twice as many scans are used."""
BODY_RADIUS_M = 0.15
"""Assumed minimum radius of a robot. Cells at most this far from the driven path are free."""
MAX_RANGE_M = 15.0
"""Maximum range that is used to build the map."""
HIT_LOG_ODDS, PASS_LOG_ODDS = 0.85, -0.4
"""Changes of the log odds of a cell by a beam that ends in the cell, and by a beam that passes the cell.

Source: Thrun, Burgard, Fox: Probabilistic Robotics, table 9.1.
"""
MAX_LOG_ODDS = 20.0
"""Maximum absolute value of the log odds of a cell."""
MIN_OCCUPIED_LOG_ODDS, MAX_FREE_LOG_ODDS = 0.8, -0.4
"""Log odds above which a cell is occupied, and below which a cell is free."""


class StaticWorld:
    """World without the objects that the reconstruction has to find.

    Attributes:
        world: Walls and known obstacles.
        height: Height of the lidar in m.
        grid: Map of the world at the height of the lidar.
        built: World with its triangles and `grid`.
    """

    def __init__(self, world: World, height: float) -> None:
        """Draw the map at `height` m. Bodies of the world, such as doors, are walls at their initial poses."""
        solids = tuple(placed_solids(world.solids, world.bodies))
        self.world, self.height = world, height
        mesh = merge_solids(solids)
        self._scene = RayScene(mesh)
        self.grid: OccupancyGrid = draw_map(replace(world, solids=solids), mesh, height)
        self.built = BuiltWorld(world, mesh, self.grid)
        is_occupied = self.grid.cells == OCCUPIED
        self._distances: Array = np.full(is_occupied.shape, UNMAPPED_DISTANCE_M)
        if is_occupied.any():
            self._distances = np.asarray(distance_transform_edt(~is_occupied)) * self.grid.resolution

    def ranges_from(self, poses: Array, angles: Array, max_range: float) -> Array:
        """Return the ranges (n, beams) in m from lidar `poses` (n, 3) in the map frame; inf beyond `max_range` m.

        `angles` (beams,) are the directions of the beams in rad in the frame of the lidar.
        """
        headings = (poses[:, 2:3] + angles[None, :]).ravel()
        directions = np.column_stack((np.cos(headings), np.sin(headings), np.zeros(len(headings))))
        heights = np.full(len(headings), self.height)
        origins = np.column_stack((np.repeat(poses[:, :2], len(angles), axis=0), heights))
        return self._scene.cast(origins, directions, max_range).reshape(len(poses), len(angles))

    def distance_to_walls(self, points: Array) -> Array:
        """Return the distance (n,) in m of `points` (n, 2) in the map frame to the nearest occupied cell."""
        cells = self.grid.cell_of(points)
        inside = self.grid.inside(cells)
        result = np.full(len(points), UNMAPPED_DISTANCE_M)
        result[inside] = self._distances[cells[inside, 0], cells[inside, 1]]
        return result


def world_from_map(grid: OccupancyGrid, name: str) -> World:
    """Return a world with this name whose walls are the occupied cells of a map."""
    return World(name, tuple(walls_from_map(grid, MAP_WALL_HEIGHT_M)), grid=grid)


def lidar_poses(drive: RecordedDrive, scans: Scans) -> Array:
    """Return the poses x, y, yaw (n, 3) of the lidar in the map frame at the times of the scans."""
    return offset_poses(drive.poses.poses_at(scans.times), scans.mount)


def offset_poses(poses: Array, offset: Pose2) -> Array:
    """Return the poses x, y, yaw (n, 3) that have the pose `offset` in the frames at `poses` (n, 3)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = poses[:, 0] + c * offset.x - s * offset.y
    y = poses[:, 1] + s * offset.x + c * offset.y
    return np.column_stack((x, y, poses[:, 2] + offset.yaw))


def beam_ends(poses: Array, angles: Array, ranges: Array) -> Array:
    """Return the ends (n, beams, 2) of beams, in the same frame as `poses`.

    poses:   poses x, y, yaw (n, 3) of the lidar
    angles:  directions of the beams (beams,) in rad, relative to the lidar
    ranges:  ranges (n, beams) in m; the end of a beam with an infinite range or nan is not finite
    """
    directions = poses[:, 2:3] + angles[None, :]
    with np.errstate(invalid="ignore"):
        x = poses[:, 0:1] + ranges * np.cos(directions)
        y = poses[:, 1:2] + ranges * np.sin(directions)
    return np.stack((x, y), axis=-1)


def map_from_scans(drive: RecordedDrive) -> OccupancyGrid:
    """Return a map built from the scans and poses of a drive. For a drive without scans, all cells are free.

    Raises InvalidInput if the map would have more than MAX_CELLS cells.
    """
    path = drive.poses.values[:, :2]
    usable_scans = None if drive.scans is None else scans_with_pose(drive, drive.scans)
    if usable_scans is None or not len(usable_scans):
        low, high = path.min(axis=0) - NO_SCANS_MARGIN_M, path.max(axis=0) + NO_SCANS_MARGIN_M
        return OccupancyGrid(np.zeros(_shape(drive, low, high), dtype=np.int8), RESOLUTION_M, Pose2(*low.tolist()))
    scans = usable_scans.thinned(TARGET_SCANS)
    poses, is_hit = lidar_poses(drive, scans), scans.is_hit() & (scans.ranges <= MAX_RANGE_M)
    ends = beam_ends(poses, scans.angles, scans.ranges)
    points = np.concatenate((ends[is_hit], path))
    low, high = points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M
    low = np.floor(low / RESOLUTION_M) * RESOLUTION_M
    log_odds = np.zeros(_shape(drive, low, high))
    for row in range(len(scans)):
        if is_hit[row].any():
            _add_scan(log_odds, poses[row, :2] - low, ends[row][is_hit[row]] - low)
    log_odds[_driven_cells(log_odds.shape, _driven_path(drive.poses) - low)] = -MAX_LOG_ODDS
    is_occupied, is_free = log_odds > MIN_OCCUPIED_LOG_ODDS, log_odds < MAX_FREE_LOG_ODDS
    cells = np.where(is_occupied, OCCUPIED, np.where(is_free, FREE, UNKNOWN))
    return OccupancyGrid(cells.astype(np.int8), RESOLUTION_M, Pose2(float(low[0]), float(low[1]), 0.0))


def _driven_path(poses: TimedValues) -> Array:
    """Return points (n, 2) at most RESOLUTION_M apart on the path through the poses.

    Jumps, which are longer than MAX_STEP_M or faster than MAX_STEP_M in STEP_S, have no points between their ends.
    """
    steps, seconds = np.diff(poses.values[:, :2], axis=0), np.diff(poses.times)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    is_jump = lengths > MAX_STEP_M * np.minimum(seconds / STEP_S, 1.0)
    counts = np.where(is_jump, 1, np.ceil(lengths / RESOLUTION_M)).astype(int)
    starts = np.repeat(np.arange(len(counts)), counts)
    fractions = (np.arange(len(starts)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[starts]
    points = poses.values[starts, :2] + fractions[:, None] * steps[starts]
    return np.concatenate((points, poses.values[-1:, :2]))


def _driven_cells(shape: tuple[int, ...], path: Array) -> Mask:
    """Return a mask (rows, columns) of the cells that are at most BODY_RADIUS_M from a path.

    The points of `path` (n, 2) are relative to the corner of the map.
    """
    is_path = np.zeros(shape, dtype=bool)
    is_path.reshape(-1)[_flat_indices(path, shape)] = True
    return distance_transform_edt(~is_path) * RESOLUTION_M <= BODY_RADIUS_M


def _shape(drive: RecordedDrive, low: Array, high: Array) -> tuple[int, int]:
    """Return the numbers of rows and columns of the map between the corners `low` (2,) and `high` (2,) in m."""
    columns, rows = np.ceil((high - low) / RESOLUTION_M).astype(int).tolist()
    if rows * columns > MAX_CELLS:
        width, height = (high - low).tolist()
        text = f"its poses and scans cover {width:.0f} m x {height:.0f} m, too much to build a map"
        raise InvalidInput([Problem(drive.name, 0, 0, "SC804", text, "give the map with --map, or cut the log")])
    return rows + 1, columns + 1


def _add_scan(log_odds: Array, origin: Array, ends: Array) -> None:
    """Update the log odds of the cells that the beams of a scan from `origin` (2,) to `ends` (n, 2) pass or hit.

    Each cell is updated once. A cell that one beam hits and another beam passes counts as hit. Coordinates are relative
    to the corner of the map.
    """
    ranges = np.hypot(*(ends - origin).T)
    distances = np.arange(0.0, float(ranges.max()), RESOLUTION_M)
    fractions = distances[None, :] / np.maximum(ranges, 1e-9)[:, None]
    is_passed = fractions < 1.0 - RESOLUTION_M / np.maximum(ranges, RESOLUTION_M)[:, None]
    points = origin + fractions[..., None] * (ends - origin)[:, None, :]
    passed, hit = _flat_indices(points[is_passed], log_odds.shape), _flat_indices(ends, log_odds.shape)
    flat = log_odds.reshape(-1)
    hit_log_odds = np.minimum(flat[hit] + HIT_LOG_ODDS, MAX_LOG_ODDS)
    flat[passed] = np.maximum(flat[passed] + PASS_LOG_ODDS, -MAX_LOG_ODDS)
    flat[hit] = hit_log_odds


def _flat_indices(points: Array, shape: tuple[int, ...]) -> Indices:
    """Return the indices (n,) of the cells of points (n, 2) in the flattened map."""
    cells = np.clip((points / RESOLUTION_M).astype(np.int64), 0, [shape[1] - 1, shape[0] - 1])
    return cells[:, 1] * shape[1] + cells[:, 0]
