"""Tests of the passages along a shortest path."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Solid
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.routes.shortest_paths import ShortestPaths

RADIUS = 0.2


def wall(name, x, y, length, width, yaw=0.0):
    return Solid(Box((length, width, 1.0)), Pose3.planar(Pose2(x, y, yaw), 0.5), name)


def leg(start, goal, *solids):
    """Return the leg from start to goal among the solids."""
    paths = ShortestPaths(merge_solids(solids), (-6, -6, 6, 6), RADIUS)
    return paths.leg(Pose2(*start), Pose2(*goal), "goal")


DOOR = wall("left", 0, 10.5, 0.1, 20), wall("right", 0, -10.5, 0.1, 20)
"""A wall along y with a door of 1 m at the origin."""


@pytest.mark.parametrize("start", [(-4, 0), (-4, 4), (-0.6, -3)])
@pytest.mark.parametrize("goal", [(4, 0), (4, 4), (0.6, 4)])
def test_door_has_its_true_width_at_any_angle_of_the_path(start, goal):
    passages = leg(start, goal, *DOOR).passages
    narrowest = min(passages, key=lambda passage: passage.width)
    assert narrowest.width == pytest.approx(1.0, abs=0.03)
    assert set(narrowest.between) == {"left", "right"}
    assert narrowest.middle == pytest.approx((0.0, 0.0), abs=0.1)


def test_passages_are_ordered_along_the_path_and_cross_it():
    corridor = wall("north", 0, 1, 8, 0.2), wall("south", 0, -1, 8, 0.2)
    passages = leg((-3.5, 0), (3.5, 0.3), *corridor).passages
    assert len(passages) > 10
    assert all(passage.width == pytest.approx(1.8, abs=0.1) for passage in passages)
    middles = [passage.middle[0] for passage in passages]
    assert middles == sorted(middles)
    assert all(min(passage.ends)[1] * max(passage.ends)[1] < 0 for passage in passages)


def test_open_space_and_a_single_wall_have_no_passages():
    assert leg((-4, 0), (4, 0)).passages == ()
    assert leg((-4, 0), (4, 0), wall("single", 0, 1, 8, 0.2)).passages == ()


def test_unreachable_goal_without_a_gap_has_no_passages():
    closed = leg((-4, 0), (4, 0), wall("across", 0, 0, 0.1, 40.0))
    assert (closed.length, closed.passages) == (math.inf, ())


def test_oblique_door_has_its_true_width():
    yaw = math.radians(50)
    posts = [
        wall(name, *(k * 1.9 * np.array([math.cos(yaw), math.sin(yaw)])), 3.0, 0.1, yaw)
        for name, k in (("a", 1), ("b", -1))
    ]
    passages = leg((-4, 0), (4, 0), *posts).passages
    assert min(passage.width for passage in passages) == pytest.approx(0.8, abs=0.03)


def test_passage_of_an_unreachable_goal_is_the_gap_that_is_too_narrow():
    narrow = wall("left", 0, 10.15, 0.1, 20), wall("right", 0, -10.15, 0.1, 20)
    closed = leg((-4, 0), (4, 0), *narrow)
    assert closed.length == math.inf
    (gap,) = closed.passages
    assert gap.width == pytest.approx(0.3, abs=0.03)
    assert set(gap.between) == {"left", "right"}
    assert leg((-4, 0), (0, 10), *narrow).passages == ()
