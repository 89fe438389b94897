"""Tests of the free space for turns in place."""

import math
from dataclasses import replace

import pytest

from simscen.core.geometry import Pose2
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.controllers.collision_checker import RotationClearance
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import CostmapView, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, box_robot, round_robot

LONG = box_robot(0.8, 0.4)
ROUND = round_robot()
HERE = Pose2(0.0, 0.0, 0.0)
SLOT = Flatland([(-0.6, 0.3, 2.0, 0.5), (-0.6, -0.5, 2.0, -0.3)])
"""Two walls, 10 cm from either side of the long robot, that end 60 cm behind its middle."""


def seen(world: Flatland, robot: RobotModel) -> CostmapView:
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid((-3.0, -3.0, 3.0, 3.0)), TICK_RATE_HZ)).view


def room_of(robot: RobotModel) -> RotationClearance:
    return RotationClearance(Footprint(robot, 0.05), robot.max_reverse)


@pytest.mark.parametrize(("gap", "room"), [(0.02, False), (0.20, True)])
def test_turn_needs_space_for_the_corners_at_all_headings(gap: float, room: bool) -> None:
    corner = math.hypot(0.4, 0.2)
    beside = seen(Flatland(discs=[(0.0, corner + gap + 0.1, 0.1)]), LONG)
    assert room_of(LONG).has_room(0.5 * math.pi, HERE, beside) == room


def test_a_short_turn_away_from_an_obstacle_is_allowed_beside_it() -> None:
    beside_the_front_corner = seen(Flatland(discs=[(0.354, 0.354, 0.05)]), LONG)
    assert not room_of(LONG).has_room(0.5, HERE, beside_the_front_corner)
    assert room_of(LONG).has_room(-0.3, HERE, beside_the_front_corner)


def test_a_robot_that_touches_something_turns_away_from_it_and_not_into_it() -> None:
    at_the_front_left = seen(Flatland(discs=[(0.34, 0.22, 0.05)]), LONG)
    assert not room_of(LONG).has_room(0.5, HERE, at_the_front_left)
    assert room_of(LONG).has_room(-0.3, HERE, at_the_front_left)


def test_long_robot_in_a_slot_backs_out() -> None:
    turning, view = room_of(LONG), seen(SLOT, LONG)
    assert not turning.has_room(0.5 * math.pi, HERE, view)
    back = turning.backup_command(HERE, view)
    assert back is not None
    assert back.vx == pytest.approx(-0.15)
    outside = Pose2(-1.2, 0.0, 0.0)
    assert turning.has_room(0.5 * math.pi, outside, view)


@pytest.mark.parametrize("side", [1, -1])
def test_robot_backs_out_along_an_arc_around_an_obstacle_behind_it(side: int) -> None:
    back = room_of(LONG).backup_command(HERE, seen(Flatland(discs=[(-0.5, side * 0.2, 0.05)]), LONG))
    assert back is not None
    assert back.vx < 0.0
    assert side * back.wz > 0.0


def test_robot_with_a_wall_behind_it_does_not_back_out() -> None:
    closed = Flatland([*SLOT.boxes, (-0.6, -0.5, -0.5, 0.5)])
    assert room_of(LONG).backup_command(HERE, seen(closed, LONG)) is None


@pytest.mark.parametrize(("max_reverse", "speed"), [(0.1, 0.1), (1.0, 0.15), (0.0, None)])
def test_robot_backs_out_at_most_at_its_reverse_speed(max_reverse: float, speed: float | None) -> None:
    back = room_of(replace(LONG, max_reverse=max_reverse)).backup_command(HERE, seen(SLOT, LONG))
    assert (None if back is None else -back.vx) == speed


def test_a_round_robot_can_always_turn() -> None:
    assert room_of(ROUND).has_room(3.0, HERE, seen(SLOT, ROUND))
