"""Computes ranges and distances to walls in the static world of a drive, and builds a map from scans if it has none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import distance_transform_edt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.geometry import Array, Pose2
from simscen.reconstruction.drive.recorded_drive import Indices, Mask, RecordedDrive, Scans
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.occupancy_map import draw_map, walls_from_map
from simscen.worlds.raycasting.ray_scene import RayScene

MAP_WALL_HEIGHT_M = 1.0
"""Height of the walls that are made from the occupied cells of a map."""
UNMAPPED_DISTANCE_M = 1e3
"""Distance to walls that is returned for points outside of the map."""


class StaticWorld:
    """World without the objects that the reconstruction has to find, and its map at the height of the lidar in m."""

    def __init__(self, world: World, height: float) -> None:
        """Cut the world at `height` m. Its bodies, such as doors, count as walls at their initial poses."""
        bodies = [replace(solid, pose=body.pose.compose(solid.pose)) for body in world.bodies for solid in body.solids]
        self.world, self.height = world, height
        mesh = merge_solids((*world.solids, *bodies))
        self._scene = RayScene(mesh)
        self.grid: OccupancyGrid = draw_map(replace(world, solids=(*world.solids, *bodies)), mesh, height)
        self.built = BuiltWorld(world, mesh, self.grid)
        distances = distance_transform_edt(self.grid.cells != OCCUPIED)
        self._distances: Array = np.asarray(distances) * self.grid.resolution

    def ranges_from(self, poses: Array, angles: Array, max_range: float) -> Array:
        """Return the ranges (n, beams) in m from lidar `poses` (n, 3) in the map frame; inf beyond `max_range` m.

        `angles` (beams,) are the directions of the beams in rad in the frame of the lidar.
        """
        directions = poses[:, 2:3] + angles[None, :]
        flat = directions.ravel()
        rays = np.column_stack((np.cos(flat), np.sin(flat), np.zeros(len(flat))))
        origins = np.column_stack((np.repeat(poses[:, :2], len(angles), axis=0), np.full(len(flat), self.height)))
        return self._scene.cast(origins, rays, max_range).reshape(len(poses), len(angles))

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
    """Return the poses x, y, yaw (n, 3) that have the pose `offset` in the frame of each of `poses` (n, 3)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = poses[:, 0] + c * offset.x - s * offset.y
    y = poses[:, 1] + s * offset.x + c * offset.y
    return np.column_stack((x, y, poses[:, 2] + offset.yaw))


def beam_ends(poses: Array, angles: Array, ranges: Array) -> Array:
    """Return the ends (n, beams, 2) of beams in the frame in which the `poses` (n, 3) of the lidar are given.

    `angles` (beams,) are relative to the lidar. The ends of beams are not finite if their `ranges` (n, beams) are not.
    """
    directions = poses[:, 2:3] + angles[None, :]
    with np.errstate(invalid="ignore"):
        x = poses[:, 0:1] + ranges * np.cos(directions)
        y = poses[:, 1:2] + ranges * np.sin(directions)
    return np.stack((x, y), axis=-1)


RESOLUTION_M = 0.05
"""Cell size of the map that is built from scans."""
MARGIN_M = 1.0
"""Distance between the border of the map and everything that was measured."""
TARGET_SCANS = 1500
"""The scans of a long drive are thinned out evenly to at least this number, and less than twice as many."""
BODY_RADIUS_M = 0.15
"""Cells that were closer to the path than this are free: every robot has at least this radius."""
MAX_RANGE_M = 15.0
"""Longer ranges are not used, because errors of the heading would blur the map."""
HIT_LOG_ODDS, PASS_LOG_ODDS, MAX_LOG_ODDS = 0.85, -0.4, 20.0
"""Change of a cell's log odds by a beam that ends in it and by one that passes it, and largest magnitude of log odds.

Source: Thrun, Burgard, Fox: Probabilistic Robotics, table 9.1.
"""
MIN_OCCUPIED_LOG_ODDS, MAX_FREE_LOG_ODDS = 0.8, -0.4
"""Log odds above which a cell is occupied, and below which it is free."""


def map_from_scans(drive: RecordedDrive) -> OccupancyGrid:
    """Return a map built from the scans of a drive at its poses; without scans, a free map around the driven path."""
    path = drive.poses.values[:, :2]
    if drive.scans is None or not len(drive.scans):
        low, high = path.min(axis=0) - 5.0, path.max(axis=0) + 5.0
        return OccupancyGrid(np.zeros(_shape(low, high), dtype=np.int8), RESOLUTION_M, Pose2(*low.tolist()))
    scans = drive.scans.thinned(TARGET_SCANS)
    poses, hits = lidar_poses(drive, scans), scans.is_hit() & (scans.ranges <= MAX_RANGE_M)
    ends = beam_ends(poses, scans.angles, scans.ranges)
    everything = np.concatenate((ends[hits], path))
    low, high = everything.min(axis=0) - MARGIN_M, everything.max(axis=0) + MARGIN_M
    low = np.floor(low / RESOLUTION_M) * RESOLUTION_M
    odds = np.zeros(_shape(low, high))
    for row in range(len(scans)):
        if hits[row].any():
            _add_scan(odds, poses[row, :2] - low, ends[row][hits[row]] - low)
    odds[_driven_over(odds.shape, path - low)] = -MAX_LOG_ODDS
    cells = np.where(odds > MIN_OCCUPIED_LOG_ODDS, OCCUPIED, np.where(odds < MAX_FREE_LOG_ODDS, FREE, UNKNOWN))
    return OccupancyGrid(cells.astype(np.int8), RESOLUTION_M, Pose2(float(low[0]), float(low[1]), 0.0))


def _driven_over(shape: tuple[int, ...], path: Array) -> Mask:
    """Return which cells (rows, columns) are within BODY_RADIUS_M of a `path` (n, 2) relative to the map's corner."""
    is_path = np.zeros(shape, dtype=bool)
    is_path.reshape(-1)[_index(path, shape)] = True
    driven: Mask = distance_transform_edt(~is_path) * RESOLUTION_M <= BODY_RADIUS_M
    return driven


def _shape(low: Array, high: Array) -> tuple[int, int]:
    columns, rows = np.ceil((high - low) / RESOLUTION_M).astype(int).tolist()
    return rows + 1, columns + 1


def _add_scan(odds: Array, origin: Array, ends: Array) -> None:
    """Update the log odds of each cell that beams from `origin` (2,) to `ends` (n, 2) pass or hit, once per scan.

    Coordinates are relative to the corner of the map.
    """
    reach = np.hypot(*(ends - origin).T)
    steps = np.arange(0.0, float(reach.max()), RESOLUTION_M)
    share = steps[None, :] / np.maximum(reach, 1e-9)[:, None]
    passes = share < 1.0 - RESOLUTION_M / np.maximum(reach, RESOLUTION_M)[:, None]
    points = origin + share[..., None] * (ends - origin)[:, None, :]
    through, hit = _index(points[passes], odds.shape), _index(ends, odds.shape)
    flat = odds.reshape(-1)
    with_hits = np.minimum(flat[hit] + HIT_LOG_ODDS, MAX_LOG_ODDS)
    flat[through] = np.maximum(flat[through] + PASS_LOG_ODDS, -MAX_LOG_ODDS)
    flat[hit] = with_hits


def _index(points: Array, shape: tuple[int, ...]) -> Indices:
    cells = np.clip((points / RESOLUTION_M).astype(np.int64), 0, [shape[1] - 1, shape[0] - 1])
    result: Indices = cells[:, 1] * shape[1] + cells[:, 0]
    return result
