"""Tests of regulated pure pursuit: curvature, regulated speed, turning in place, and obstacles."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.controllers import RegulatedPurePursuit as Spec
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.protocols import CostmapView, NavigationFailure, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot, setting

ROBOT = round_robot(speed=1.0)
FAR = Goal("far", Pose2(8.0, 0.0, 0.0))
FIXED_LOOKAHEAD = {"use_velocity_scaled_lookahead_dist": False, "lookahead_dist": 0.6}


def view_of(*boxes: tuple[float, float, float, float]) -> CostmapView:
    grid = Flatland(list(boxes)).grid((-3.0, -4.0, 9.0, 4.0))
    return LayeredCostmap(CostmapSpec(), Surroundings(ROBOT, grid, TICK_RATE_HZ)).view


def rpp(path: np.ndarray, **options: object) -> RegulatedPurePursuit:
    controller = RegulatedPurePursuit(Spec(**{**FIXED_LOOKAHEAD, **options}), setting(ROBOT))
    controller.set_path(Path(path))
    return controller


def line(length: float = 8.0, y: float = 0.0) -> np.ndarray:
    x = np.arange(0.0, length + 1e-9, 0.05)
    return np.column_stack((x, np.full_like(x, y), np.zeros_like(x)))


def test_the_curvature_is_twice_the_offset_over_the_square_of_the_distance() -> None:
    command = rpp(line(y=0.2)).command(Pose2(1, 0, 0), Twist(), view_of(), FAR)
    assert command.wz / command.vx == pytest.approx(2 * 0.2 / 0.6**2)


def test_robot_in_free_space_drives_at_the_desired_speed() -> None:
    assert rpp(line(), desired_linear_vel=0.7).command(Pose2(1, 0, 0), Twist(), view_of(), FAR) == Twist(0.7)


def test_speed_is_proportional_to_curvature_radius_below_the_regulated_radius() -> None:
    command = rpp(line(y=0.3)).command(Pose2(1, 0, 0), Twist(), view_of(), FAR)
    radius = 0.6**2 / (2 * 0.3)
    assert command.vx == pytest.approx(0.5 * radius / 0.9)


def test_speed_near_a_wall_is_scaled_down_to_the_minimum() -> None:
    wall = view_of((-3.0, 0.42, 9.0, 0.6))
    row = round(0 / 0.05 + 4.0 / 0.05)
    distance = float(wall.distance[row, 80])
    assert rpp(line()).command(Pose2(1.01, 0.01, 0), Twist(), wall, FAR).vx == pytest.approx(
        0.5 * distance / 0.6, rel=1e-3
    )
    near_wall = view_of((-3.0, 0.30, 9.0, 0.6))
    assert rpp(line()).command(Pose2(1.01, 0.01, 0), Twist(), near_wall, FAR).vx == pytest.approx(0.25, abs=0.01)


def test_robot_slows_down_toward_the_end_of_the_path() -> None:
    goal = Goal("g", Pose2(2.0, 0.0))
    controller = rpp(line(2.0))
    controller.command(Pose2(1.0, 0.0, 0.0), Twist(0.5), view_of(), goal)
    command = controller.command(Pose2(1.7, 0.0, 0.0), Twist(0.3), view_of(), goal)
    assert command.vx == pytest.approx(0.5 * 0.3 / 0.6, rel=0.02)


def test_robot_first_turns_to_a_path_behind_it_with_bounded_acceleration() -> None:
    controller = rpp(line())
    command = controller.command(Pose2(1, 0, math.pi), Twist(), view_of(), FAR)
    assert command.vx == 0.0
    assert abs(command.wz) == pytest.approx(3.2 * 0.05)


def test_robot_drives_on_if_turning_in_place_is_disabled() -> None:
    assert rpp(line(), use_rotate_to_heading=False).command(Pose2(1, 0, 1.2), Twist(), view_of(), FAR).vx > 0.0


def test_the_lookahead_grows_with_speed_between_its_bounds() -> None:
    options = {"use_velocity_scaled_lookahead_dist": True}
    for speed, lookahead in ((0.0, 0.3), (0.4, 0.6), (0.9, 0.9)):
        command = rpp(line(y=0.1), **options).command(Pose2(1, 0, 0), Twist(speed), view_of(), FAR)
        assert command.wz / command.vx == pytest.approx(2 * 0.1 / lookahead**2)


def test_robot_slows_down_before_an_obstacle_and_then_fails() -> None:
    wall = view_of((3.0, -4.0, 3.2, 4.0))
    controller = rpp(line(), use_cost_regulated_linear_velocity_scaling=False)
    speeds = []
    with pytest.raises(NavigationFailure) as failure:
        for x in np.arange(1.0, 3.0, 0.05):
            speeds.append(controller.command(Pose2(float(x), 0.0, 0.0), Twist(0.5), wall, FAR).vx)
    assert failure.value.code == ErrorCode.NO_VALID_CONTROL
    assert speeds[0] == 0.5
    assert 0.1 <= speeds[-1] < 0.2
    assert speeds == sorted(speeds, reverse=True)
    assert 1.0 + 0.05 * len(speeds) < 3.0 - 0.22


def test_robot_at_the_goal_turns_to_its_heading_and_stops() -> None:
    goal = Goal("g", Pose2(2.0, 0.0, 1.0))
    controller = rpp(line(2.0))
    assert controller.command(Pose2(1.95, 0, 0), Twist(), view_of(), goal).wz > 0.0
    assert controller.command(Pose2(1.95, 0, 1.0), Twist(), view_of(), goal) == STOP


def test_carrot_moves_nearer_if_the_arc_would_cut_a_corner() -> None:
    """The path leads around a pillar on the left. The arc to a distant carrot leads through the pillar."""
    y = np.arange(0.05, 3.0, 0.05)
    corner = np.vstack((line(1.0), np.column_stack((np.full_like(y, 1.0), y, np.full_like(y, np.pi / 2)))))
    pillar = view_of((0.45, 0.30, 0.70, 0.55))
    pose = Pose2(0.3, 0.0, 0.0)
    options = {
        "lookahead_dist": 1.2,
        "rotate_to_heading_min_angle": 1.5,
        "max_allowed_time_to_collision_up_to_carrot": 4.0,
    }
    without_pillar = rpp(corner, **options).command(pose, Twist(), view_of(), FAR)
    with_pillar = rpp(corner, **options).command(pose, Twist(), pillar, FAR)
    assert without_pillar.wz / without_pillar.vx > 0.8
    assert with_pillar.vx >= 0.25
    assert with_pillar.wz / with_pillar.vx < 0.4


def test_robot_pushed_past_the_end_of_its_path_reverses_at_normal_speed() -> None:
    """The robot has evaded an obstacle at its goal, and has to drive 0.5 m back."""
    goal, controller = Goal("g", Pose2(2.0, 0.0)), rpp(line(2.0))
    controller.command(Pose2(1.95, 0.0, 0.0), Twist(0.1), view_of(), goal)
    command = controller.command(Pose2(2.5, 0.0, math.pi), Twist(0.1), view_of(), goal)
    assert command.vx == pytest.approx(0.5 * 0.5 / 0.6, rel=0.02)
