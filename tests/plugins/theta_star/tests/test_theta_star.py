"""Tests of Lazy Theta*: the contract of planners, and the length of its paths."""

import math

import pytest
from theta_star.spec import ThetaStar

from simscen.plugin import Pose2
from simscen.testing import promises_of
from simscen.testing.contracts.base import costmap_of_world
from simscen.testing.flatland import Flatland, round_robot, setting


@pytest.mark.parametrize("promise", promises_of(ThetaStar()), ids=str)
def test_component_meets_its_contract(promise) -> None:
    promise.check()


def test_path_in_free_space_is_straight() -> None:
    robot = round_robot()
    view = costmap_of_world(Flatland().room(8, 6), robot, (-0.5, -0.5, 8.5, 6.5))
    planner = ThetaStar.implementation()(ThetaStar(), setting(robot))
    start, goal = Pose2(1.0, 1.0), Pose2(7.0, 4.3)
    assert planner.plan(view, start, goal, 1).length() == pytest.approx(start.distance(goal), rel=0.02)


def test_path_around_a_corner_is_taut() -> None:
    robot = round_robot()
    world = Flatland().room(8, 6)
    world.boxes.append((3.9, 0.0, 4.1, 3.0))
    view = costmap_of_world(world, robot, (-0.5, -0.5, 8.5, 6.5))
    planner = ThetaStar.implementation()(ThetaStar(clearance=0.0), setting(robot))
    start, goal = Pose2(1.0, 1.0), Pose2(7.0, 1.0)
    shortest = 2 * math.dist((1.0, 1.0), (3.9, 3.24)) + 0.2
    assert planner.plan(view, start, goal, 1).length() == pytest.approx(shortest, rel=0.05)
