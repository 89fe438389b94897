"""Tests of motion along arcs, of the time to collision, and of footprints in collision."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.controllers.collision_checker import CollisionChecker, time_to_collision
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.footprint import Footprint
from simscen.stack.kinematics import poses_along
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, box_robot, round_robot


def view_of(world: Flatland, robot: RobotModel) -> CostmapView:
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid((-2.0, -2.0, 6.0, 2.0)), TICK_RATE_HZ)).view


def test_arc_equals_a_numerical_integration() -> None:
    twist, pose = Twist(0.7, 0.2, -0.9), Pose2(1.0, 2.0, 0.4)
    x, y, yaw = pose
    for _ in range(200_000):
        dt = 1.5 / 200_000
        x += (twist.vx * math.cos(yaw) - twist.vy * math.sin(yaw)) * dt
        y += (twist.vx * math.sin(yaw) + twist.vy * math.cos(yaw)) * dt
        yaw += twist.wz * dt
    assert poses_along(pose, twist, np.array([1.5]))[0] == pytest.approx((x, y, yaw), abs=1e-5)
    straight = poses_along(pose, Twist(1.0), np.array([2.0]))[0]
    assert straight == pytest.approx((1 + 2 * math.cos(0.4), 2 + 2 * math.sin(0.4), 0.4))


def test_time_to_collision_is_distance_divided_by_speed() -> None:
    robot = round_robot()
    view = view_of(Flatland(boxes=[(2.0, -1.0, 2.5, 1.0)]), robot)
    free = time_to_collision(Footprint(robot, 0.05), view, Pose2(0, 0), Twist(0.5), 10.0)
    assert free == pytest.approx((2.0 - 0.22) / 0.5, abs=0.06 / 0.5)


def test_robot_in_collision_may_leave_but_not_move_deeper() -> None:
    robot = round_robot()
    view = view_of(Flatland(boxes=[(2.0, -1.0, 2.5, 1.0)]), robot)
    footprint = Footprint(robot, 0.05)
    assert time_to_collision(footprint, view, Pose2(1.85, 0), Twist(-0.5), 1.0) == 1.0
    assert time_to_collision(footprint, view, Pose2(1.85, 0), Twist(0.5), 1.0) < 0.2


def view_of_posts(*posts: tuple[float, float]) -> CostmapView:
    """Return a costmap with one lethal cell of 5 cm at the center of each post."""
    views = [view_of_post(*post) for post in posts]
    return replace(views[0], distance=np.minimum.reduce([view.distance for view in views]))


@pytest.mark.parametrize("robot", [box_robot(0.42, 0.42), round_robot(0.21)])
def test_robot_in_contact_cannot_drive_into_another_obstacle(robot: RobotModel) -> None:
    """The robot overlaps a post on its left by 4 cm, and backs up until it touches a post behind it."""
    footprint, beside, behind = Footprint(robot, 0.05), (0.025, 0.175), (-0.375, 0.025)
    back = Twist(-0.15, 0.0, 0.0)
    assert time_to_collision(footprint, view_of_posts(beside), Pose2(0, 0), back, 2.0) == 2.0
    assert not footprint.free(view_of_posts(beside), np.zeros((1, 3)))[0]
    assert time_to_collision(footprint, view_of_posts(beside, behind), Pose2(0, 0), back, 2.0) == pytest.approx(
        1.0, abs=0.3
    )


def test_footprint_collides_if_its_edge_or_interior_is_occupied() -> None:
    robot = box_robot(1.0, 0.4)
    view = view_of(Flatland(discs=[(2.0, 0.0, 0.05)]), robot)
    footprint = Footprint(robot, 0.05)
    poses = np.array([[1.4, 0, 0], [1.55, 0, 0], [2.0, 0, 0], [2.0, 0.35, 0], [2.0, 0.35, 1.57]])
    assert footprint.free(view, poses).tolist() == [True, False, False, True, False]


def view_of_post(x: float, y: float) -> CostmapView:
    """Return a costmap with one lethal cell of 5 cm at the center of a post."""
    rows, columns = np.mgrid[0:80, 0:80]
    row, column = math.floor((y + 2.0) / 0.05), math.floor((x + 2.0) / 0.05)
    distance = (0.05 * np.hypot(rows - row, columns - column)).astype(np.float32)
    return CostmapView(np.where(distance == 0.0, 254, 0).astype(np.uint8), distance, 0.05, (-2.0, -2.0))


@pytest.mark.parametrize(("x", "y", "depth"), [(0.475, 0.125, 0.025), (0.375, -0.075, 0.125), (-0.325, 0.125, 0.075)])
def test_clearance_of_a_long_hull_in_collision_is_the_penetration_depth(x: float, y: float, depth: float) -> None:
    footprint = Footprint(box_robot(1.0, 0.4), 0.05)
    clearance = footprint.clearance(view_of_post(x, y), np.array([[0.0, 0.0, 0.0]]))
    assert clearance == pytest.approx([-depth], abs=0.036)


def test_long_robot_in_contact_may_turn_away_but_not_deeper() -> None:
    footprint, view = Footprint(box_robot(1.0, 0.4), 0.05), view_of_post(0.425, 0.19)
    assert not footprint.free(view, np.array([[0.0, 0.0, 0.0]]))[0]
    assert time_to_collision(footprint, view, Pose2(0, 0), Twist(0.0, 0.0, -0.5), 1.0) == 1.0
    assert time_to_collision(footprint, view, Pose2(0, 0), Twist(0.0, 0.0, 0.5), 1.0) < 0.4


def test_discs_cover_the_hull() -> None:
    robot = box_robot(0.9, 0.3)
    discs = Footprint(robot, 0.05).discs
    rng = np.random.default_rng(1)
    inside = rng.uniform((-0.45, -0.15), (0.45, 0.15), (2000, 2))
    distances = np.hypot(inside[:, None, 0] - discs.offsets, inside[:, None, 1]).min(axis=1)
    assert distances.max() <= discs.radius
    assert discs.radius < 0.25


def test_commands_are_not_slowed_below_the_minimum_speed() -> None:
    footprint, command = Footprint(round_robot(), 0.05), Twist(0.5, 0.0, 0.2)
    assert CollisionChecker(footprint, 0.1).slow_down(command, 0.2, 1.0, 1.0) == pytest.approx(Twist(0.1, 0.0, 0.04))
    assert CollisionChecker(footprint, 0.04).slow_down(command, 0.1, 1.0, 1.0).vx == pytest.approx(0.05)
    with pytest.raises(NavigationFailure) as failure:
        CollisionChecker(footprint, 0.1).slow_down(command, 0.1, 1.0, 1.0)
    assert failure.value.code is ErrorCode.NO_VALID_CONTROL
