"""Tests that third-party worlds and maps of the same place agree."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED
from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.model.world import RosMapSpec
from simscen.worlds.built_world import build_world_and_map
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.ros_map import load_map
from simscen.worlds.raycasting.ray_scene import RayScene
from simscen.worlds.routes.shortest_paths import legs_between
from simscen.worlds.sdf import load_sdf

DATA = Path(__file__).parents[4] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the third-party worlds are missing: see CONTRIBUTING.md")
LIDAR_HEIGHT_M = 0.18


def shipped_map(path):
    spec = RosMapSpec.model_validate({"mode": "trinary", **yaml.safe_load(path.read_text())})
    return load_map(spec, path.parent / spec.image)[0]


def free_poses(grid, count, seed):
    """Return the centers (count, 2) of random cells with a clearance of more than 0.2 m."""
    from scipy import ndimage

    has_clearance = ndimage.distance_transform_edt(grid.cells == FREE) * grid.resolution > 0.2
    cells = np.argwhere(has_clearance)
    return grid.center_of(cells[np.random.default_rng(seed).choice(len(cells), count, replace=False)])


def beams_from(points, count):
    """Return the starts and directions of `count` beams all around each point."""
    angles = np.arange(count) * (2 * math.pi / count)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    return np.repeat(points, count, axis=0), np.tile(directions, (len(points), 1))


def ranges_on_map(grid, starts, directions, reach=12.0):
    """Return the ranges to the first occupied cell by Bresenham steps, as in map_calc_range of AMCL."""
    first = grid.cell_of(starts)
    step = directions[:, ::-1] / np.abs(directions).max(axis=1)[:, None]
    cells = np.round(first[:, None] + np.arange(reach / grid.resolution)[:, None] * step[:, None]).astype(int)
    hit = (grid.values_at(grid.center_of(cells.reshape(-1, 2))) == OCCUPIED).reshape(cells.shape[:2])
    last = cells[np.arange(len(cells)), np.argmax(hit, axis=1)]
    return np.where(hit.any(axis=1), np.linalg.norm(last - first, axis=1) * grid.resolution, math.inf)


@needs_data
def test_rays_in_tb3_sandbox_agree_with_its_shipped_map():
    folder = DATA / "nav2_tb3_sandbox"
    world = load_sdf(folder / "worlds" / "tb3_sandbox.sdf.xacro", root=DATA, search=[folder / "models"], lenient=True)
    grid = shipped_map(folder / "tb3_sandbox.yaml")
    points = free_poses(grid, 60, seed=1)
    starts, directions = beams_from(points, 90)
    origins = np.column_stack((starts, np.full(len(starts), LIDAR_HEIGHT_M)))
    level = np.column_stack((directions, np.zeros(len(directions))))
    ranges = RayScene(merge_solids(world.solids)).cast(origins, level)
    assert (np.abs(ranges - ranges_on_map(grid, starts, directions)) < 0.15).mean() >= 0.92


@needs_data
def test_map_of_tb3_sandbox_agrees_with_the_shipped_map_where_a_robot_can_be():
    folder = DATA / "nav2_tb3_sandbox"
    world = load_sdf(folder / "worlds" / "tb3_sandbox.sdf.xacro", root=DATA, search=[folder / "models"], lenient=True)
    built = build_world_and_map(world, LIDAR_HEIGHT_M)
    shipped = shipped_map(folder / "tb3_sandbox.yaml")
    points = free_poses(shipped, 500, seed=2)
    assert (built.map.values_at(points) == FREE).mean() > 0.98


@needs_data
def test_every_barn_world_admits_a_disc_of_37_cm_with_a_shortest_path_up_to_the_reference_length():
    rows = [line.split(",") for line in (DATA / "barn_sample" / "scenarios.csv").read_text().split()[1:]]
    for number, reference in ((row[0], float(row[9])) for row in rows):
        world = load_sdf(DATA / "barn_sample" / f"world_{number}.world", root=DATA, lenient=True)
        built = build_world_and_map(world, 0.3)
        (leg,) = legs_between(built, [(Pose2(-2.25, 3.0), Goal("end", Pose2(-2.25, 13.0)))], 0.37)
        assert 9.99 < leg.length < 1.3 * reference
