"""The static world of a drive: what a lidar without faults would measure in it, and how far a point is from a wall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import distance_transform_edt

from simscen.core.environment.occupancy_grid import OCCUPIED, OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.geometry import Array, Pose2
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, Scans
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.occupancy_map import draw_map, walls_from_map
from simscen.worlds.raycasting.ray_scene import RayScene

MAP_WALL_HEIGHT_M = 1.0
"""Height of the walls of a map."""
UNMAPPED_DISTANCE_M = 1e3
"""Distance from walls that counts outside of the map."""


class Surroundings:
    """Static world at the height of the lidar, without anything that the reconstruction has to find."""

    def __init__(self, world: World, height: float) -> None:
        """Take the world, with its objects and doors at their initial poses, and the `height` of the lidar in m."""
        bodies = [replace(solid, pose=body.pose.compose(solid.pose)) for body in world.bodies for solid in body.solids]
        self.world, self.height = world, height
        mesh = merge_solids((*world.solids, *bodies))
        self._scene = RayScene(mesh)
        self.grid: OccupancyGrid = draw_map(replace(world, solids=(*world.solids, *bodies)), mesh, height)
        self.built = BuiltWorld(world, mesh, self.grid)
        distances = distance_transform_edt(self.grid.cells != OCCUPIED)
        self._distances: Array = np.asarray(distances) * self.grid.resolution

    def ranges_from(self, poses: Array, angles: Array, max_range: float) -> Array:
        """Return the ranges (n, beams) in m at lidar poses (n, 3) in the map frame; inf beyond `max_range` m.

        `angles` (beams,) are the directions of the beams in rad in the frame of the lidar.
        """
        directions = poses[:, 2:3] + angles[None, :]
        flat = directions.ravel()
        rays = np.column_stack((np.cos(flat), np.sin(flat), np.zeros(len(flat))))
        origins = np.column_stack((np.repeat(poses[:, :2], len(angles), axis=0), np.full(len(flat), self.height)))
        return self._scene.cast(origins, rays, max_range).reshape(len(poses), len(angles))

    def distance_to_walls(self, points: Array) -> Array:
        """Return the distance (n,) in m of points (n, 2) to the nearest occupied cell.

        It is UNMAPPED_DISTANCE_M outside of the map.
        """
        cells = self.grid.cell_of(points)
        inside = self.grid.inside(cells)
        result = np.full(len(points), UNMAPPED_DISTANCE_M)
        result[inside] = self._distances[cells[inside, 0], cells[inside, 1]]
        return result


def world_from_map(grid: OccupancyGrid, name: str) -> World:
    """Return a world whose walls are the occupied cells of a map."""
    return World(name, tuple(walls_from_map(grid, MAP_WALL_HEIGHT_M)), grid=grid)


def lidar_poses(drive: RecordedDrive, scans: Scans) -> Array:
    """Return the poses (n, 3) of the lidar in the map frame when it measured each scan."""
    base = drive.poses.poses_at(scans.times)
    mount: Pose2 = scans.mount
    c, s = np.cos(base[:, 2]), np.sin(base[:, 2])
    x = base[:, 0] + c * mount.x - s * mount.y
    y = base[:, 1] + s * mount.x + c * mount.y
    return np.column_stack((x, y, base[:, 2] + mount.yaw))


def beam_ends(poses: Array, angles: Array, ranges: Array) -> Array:
    """Return the ends (n, beams, 2) of beams in the map frame; nan or inf where a range is."""
    directions = poses[:, 2:3] + angles[None, :]
    with np.errstate(invalid="ignore"):
        x = poses[:, 0:1] + ranges * np.cos(directions)
        y = poses[:, 1:2] + ranges * np.sin(directions)
    return np.stack((x, y), axis=-1)
