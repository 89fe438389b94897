"""Where a hull with corners may turn, against what the clearance of the world itself says."""

import math

import pytest
from flatland import RATE, Flatland, box_robot, round_robot

from simscen.core.geometry import Pose2
from simscen.model.stack import Costmap as CostmapSpec
from simscen.stack.controllers.turning import TurningRoom
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import CostmapView, RobotModel, Surroundings

LONG = box_robot(0.8, 0.4)
ROUND = round_robot()
HERE = Pose2(0.0, 0.0, 0.0)
SLOT = Flatland([(-0.6, 0.3, 2.0, 0.5), (-0.6, -0.5, 2.0, -0.3)])
"""Two walls, 10 cm from either side of the long robot, that end 60 cm behind its middle."""


def seen(world: Flatland, robot: RobotModel) -> CostmapView:
    return Costmap(CostmapSpec(), Surroundings(robot, world.grid((-3.0, -3.0, 3.0, 3.0)), RATE)).view


def room_of(robot: RobotModel) -> TurningRoom:
    return TurningRoom(Footprint(robot, 0.05))


def test_in_the_open_the_short_way_round_is_taken() -> None:
    assert room_of(LONG).way_round(1.0, HERE, seen(Flatland(), LONG)) == 1.0


def test_where_the_short_way_is_blocked_the_long_way_round_is_taken() -> None:
    beside_the_front = Flatland(discs=[(0.25, 0.33, 0.05)])
    # The corner sweeps to 0.45 m: a quarter turn to the left would hit, and so would three quarters to the right.
    assert room_of(LONG).way_round(0.5 * math.pi, HERE, seen(beside_the_front, LONG)) is None
    assert room_of(LONG).way_round(-0.5 * math.pi, HERE, seen(Flatland(discs=[(0.0, 0.6, 0.1)]), LONG)) is not None


def test_a_long_robot_in_a_slot_backs_out_of_it() -> None:
    turning, view = room_of(LONG), seen(SLOT, LONG)
    assert turning.way_round(0.5 * math.pi, HERE, view) is None
    back = turning.back_out(HERE, view)
    assert back is not None
    assert back.vx == pytest.approx(-0.15)
    outside = Pose2(-1.2, 0.0, 0.0)
    assert turning.way_round(0.5 * math.pi, outside, view) == 0.5 * math.pi


def test_a_robot_with_its_back_to_the_wall_does_not_back_out() -> None:
    closed = Flatland([*SLOT.boxes, (-0.6, -0.5, -0.5, 0.5)])
    assert room_of(LONG).back_out(HERE, seen(closed, LONG)) is None


def test_a_round_robot_can_always_turn() -> None:
    assert room_of(ROUND).way_round(3.0, HERE, seen(SLOT, ROUND)) == 3.0
