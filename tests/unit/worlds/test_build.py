"""Tests of worlds that are built together with their map."""

import pickle

import numpy as np

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Solid
from simscen.worlds.built_world import build_world_and_map


def test_an_empty_world_is_a_small_free_map():
    built = build_world_and_map(World("nothing", ()), 0.2)
    assert built.map.shape == (40, 40)
    assert not built.map.cells.any()


def test_world_built_twice_is_bit_identical():
    world = World("w", tuple(Solid(Box((1.0, 0.3, 1.0)), Pose3(k, 0.1 * k, 0.5), f"b{k}") for k in range(20)))
    assert pickle.dumps(build_world_and_map(world, 0.3)) == pickle.dumps(build_world_and_map(world, 0.3))


def test_map_contains_only_solids_at_the_height_of_the_lidar():
    world = World("w", (Solid(Box((1.0, 1.0, 0.2)), Pose3(z=0.1)),))
    assert build_world_and_map(world, 0.1).map.cells.any()
    assert not np.any(build_world_and_map(world, 0.3).map.cells)
