"""Tests of whether a robot has space to turn in place, and of backing up to get space."""

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

RECTANGULAR = box_robot(0.8, 0.4)
ROUND = round_robot()
ORIGIN = Pose2(0.0, 0.0, 0.0)
SLOT = Flatland([(-0.6, 0.3, 2.0, 0.5), (-0.6, -0.5, 2.0, -0.3)])
"""Two walls, 10 cm from the sides of the rectangular robot, that end 60 cm behind its center."""


def view_of(world: Flatland, robot: RobotModel) -> CostmapView:
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid((-3.0, -3.0, 3.0, 3.0)), TICK_RATE_HZ)).view


def rotation_clearance(robot: RobotModel) -> RotationClearance:
    return RotationClearance(Footprint(robot, 0.05), robot.max_reverse)


@pytest.mark.parametrize(("gap", "has_room"), [(0.02, False), (0.20, True)])
def test_turn_needs_space_for_the_corners_at_all_headings(gap: float, has_room: bool) -> None:
    corner = math.hypot(0.4, 0.2)
    view = view_of(Flatland(discs=[(0.0, corner + gap + 0.1, 0.1)]), RECTANGULAR)
    assert rotation_clearance(RECTANGULAR).has_room(0.5 * math.pi, ORIGIN, view) == has_room


def test_short_turn_away_from_a_near_obstacle_is_allowed() -> None:
    view = view_of(Flatland(discs=[(0.354, 0.354, 0.05)]), RECTANGULAR)
    assert not rotation_clearance(RECTANGULAR).has_room(0.5, ORIGIN, view)
    assert rotation_clearance(RECTANGULAR).has_room(-0.3, ORIGIN, view)


def test_robot_in_contact_may_turn_away_from_the_obstacle_but_not_into_it() -> None:
    view = view_of(Flatland(discs=[(0.34, 0.22, 0.05)]), RECTANGULAR)
    assert not rotation_clearance(RECTANGULAR).has_room(0.5, ORIGIN, view)
    assert rotation_clearance(RECTANGULAR).has_room(-0.3, ORIGIN, view)


def test_long_robot_in_a_slot_backs_out() -> None:
    clearance, view = rotation_clearance(RECTANGULAR), view_of(SLOT, RECTANGULAR)
    assert not clearance.has_room(0.5 * math.pi, ORIGIN, view)
    command = clearance.backup_command(ORIGIN, view)
    assert command is not None
    assert command.vx == pytest.approx(-0.15)
    outside = Pose2(-1.2, 0.0, 0.0)
    assert clearance.has_room(0.5 * math.pi, outside, view)


@pytest.mark.parametrize("side", [1, -1])
def test_robot_backs_out_along_an_arc_around_an_obstacle_behind_it(side: int) -> None:
    command = rotation_clearance(RECTANGULAR).backup_command(
        ORIGIN, view_of(Flatland(discs=[(-0.5, side * 0.2, 0.05)]), RECTANGULAR)
    )
    assert command is not None
    assert command.vx < 0.0
    assert side * command.wz > 0.0


def test_robot_with_a_wall_behind_it_does_not_back_out() -> None:
    closed = Flatland([*SLOT.boxes, (-0.6, -0.5, -0.5, 0.5)])
    assert rotation_clearance(RECTANGULAR).backup_command(ORIGIN, view_of(closed, RECTANGULAR)) is None


@pytest.mark.parametrize(("max_reverse", "speed"), [(0.1, 0.1), (1.0, 0.15), (0.0, None)])
def test_robot_backs_out_at_most_at_its_reverse_speed(max_reverse: float, speed: float | None) -> None:
    command = rotation_clearance(replace(RECTANGULAR, max_reverse=max_reverse)).backup_command(
        ORIGIN, view_of(SLOT, RECTANGULAR)
    )
    assert (None if command is None else -command.vx) == speed


def test_a_round_robot_can_always_turn() -> None:
    assert rotation_clearance(ROUND).has_room(3.0, ORIGIN, view_of(SLOT, ROUND))
