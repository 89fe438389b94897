"""Tests of the static world of a recorded drive: walls of a map, and the map that is built from scans."""

import numpy as np
import synthetic_drives as drives

from simscen.core.environment.occupancy_grid import FREE, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.reconstruction.drive.recorded_drive import Scans
from simscen.reconstruction.static_world import UNMAPPED_DISTANCE_M, StaticWorld, map_from_scans, world_from_map


def test_distance_to_walls_is_the_maximum_on_a_map_without_walls():
    grid = OccupancyGrid(np.full((100, 100), FREE, np.int8), 0.05, Pose2(0.0, 0.0))
    world = StaticWorld(world_from_map(grid, "free"), drives.HEIGHT)
    assert (world.distance_to_walls(np.array([[0.02, 0.02], [2.5, 2.5]])) == UNMAPPED_DISTANCE_M).all()


def map_of_drive(times, x):
    """Return the map of a drive along the x axis by a lidar that only sees walls on both sides."""
    ranges = np.full((len(times), drives.BEAMS), np.inf)
    ranges[:, [drives.BEAMS // 4, 3 * drives.BEAMS // 4]] = 3.0
    is_malformed = np.zeros(len(times), bool)
    measured = Scans(times, times, ranges, drives.ANGLES, 0.1, 12.0, Pose2(0.0, 0.0), drives.HEIGHT, is_malformed)
    poses = drives.signal(times, np.column_stack((x, 0 * x, 0 * x)))
    return map_from_scans(drives.drive(measured, poses=poses))


def is_free(grid, x):
    cells = grid.cell_of(np.column_stack((x, 0 * x)))
    return grid.cells[cells[:, 0], cells[:, 1]] == FREE


def test_the_driven_path_is_free_between_rare_poses():
    times = np.arange(0.0, 10.0)
    assert is_free(map_of_drive(times, 0.8 * times), np.arange(0.0, 7.2, 0.02)).all()


def test_a_jump_of_the_pose_frees_nothing_between_its_ends():
    times = np.arange(0.0, 4.0, 0.1)
    grid = map_of_drive(times, np.where(times < 2.0, 0.2 * times, 1.2 + 0.2 * times))
    assert is_free(grid, np.array([0.3, 1.7])).all()
    assert not is_free(grid, np.arange(0.6, 1.4, 0.02)).any()
