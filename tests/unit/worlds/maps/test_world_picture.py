"""Tests of the picture of a world."""

import math

import numpy as np
import pytest

from simscen.core.environment.occupancy_grid import OCCUPIED, OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body, Box, Solid
from simscen.worlds.built_world import build_world_and_map
from simscen.worlds.maps.occupancy_map import walls_from_map
from simscen.worlds.maps.world_picture import (
    BODY_COLOR,
    FREE_COLOR,
    OCCUPIED_COLOR,
    SUPERSAMPLING,
    _viewport,
    draw_world,
)


def color_at(image, built, x, y):
    view = _viewport(built.map)
    ((column, row),) = view.pixels(np.array([[x, y]]))
    return image.getpixel((int(column / SUPERSAMPLING), int(row / SUPERSAMPLING)))


def is_similar(color, expected):
    return all(abs(a - b) < 40 for a, b in zip(color, expected[:3], strict=True))


def test_picture_shows_walls_ground_and_bodies_at_their_positions():
    crate = Body("", (Solid(Box((1.0, 1.0, 0.1)), Pose3(z=0.05)),), Pose3(-1, 0, 0))
    world = World("w", (Solid(Box((1.0, 1.0, 1.0)), Pose3(2, 1, 0.5)),), (crate,), bounds=(-3, -2, 3, 2))
    built = build_world_and_map(world, 0.3)
    image = draw_world(built, 0.3)
    assert max(image.size) == 1200
    assert image.size[0] / image.size[1] == pytest.approx(8 / 6, rel=0.01)
    assert is_similar(color_at(image, built, 2, 1), OCCUPIED_COLOR)
    assert is_similar(color_at(image, built, 0, -1), FREE_COLOR)
    assert is_similar(color_at(image, built, -1.5, 0.2), BODY_COLOR)


def test_map_with_a_yaw_is_aligned_with_its_walls_in_the_picture():
    cells = np.zeros((30, 60), np.int8)
    cells[10:20, 40:50] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, Pose2(1.0, 2.0, math.pi / 5))
    built = build_world_and_map(World("w", tuple(walls_from_map(grid, 1.0)), grid=grid), 0.3)
    image = draw_world(built, 0.3)
    on_wall, next_to_wall = grid.center_of(np.array([[15, 45], [5, 45]]))
    assert is_similar(color_at(image, built, *on_wall), OCCUPIED_COLOR)
    assert is_similar(color_at(image, built, *next_to_wall), FREE_COLOR)


def test_empty_world_has_a_picture():
    assert draw_world(build_world_and_map(World("w", ()), 0.2), 0.2).size == (1200, 1200)
