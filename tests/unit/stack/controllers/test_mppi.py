"""Tests of MPPI: reached speeds, and parts against values computed by hand from nav2_mppi_controller."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Path
from simscen.model import mppi as model
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.controllers.mppi import critics
from simscen.stack.controllers.mppi.control_sequence import apply_limits, shift_sequence, smooth_sequence
from simscen.stack.controllers.mppi.controller import MppiController
from simscen.stack.controllers.mppi.critic_data import CriticData
from simscen.stack.controllers.mppi.rollouts import (
    Rollouts,
    apply_model_delay,
    integrate_velocities,
    predict_velocities,
)
from simscen.stack.controllers.path_handler import UpcomingPath
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.footprint import Footprint
from simscen.stack.kinematics import VelocityLimits, poses_along
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, box_robot, round_robot, setting

PERIOD = 0.05
LIMITS = VelocityLimits((-0.35, -0.5, -1.9), (0.5, 0.5, 1.9), (3.0, 3.0, 3.5), (-3.0, -3.0, -3.5), 0.0)


def view_of(*boxes: tuple[float, float, float, float], length: float = 12.0) -> CostmapView:
    grid = Flatland(list(boxes)).grid((-2.0, -3.0, length, 3.0))
    return LayeredCostmap(CostmapSpec(), Surroundings(round_robot(), grid, TICK_RATE_HZ)).view


def straight(length: float) -> np.ndarray:
    x = np.arange(0.0, length + 1e-9, 0.05)
    return np.column_stack((x, np.zeros_like(x), np.zeros_like(x)))


def driven(robot: RobotModel, length: float, seconds: float, **options: Any) -> list[Twist]:
    """Commands on an empty straight, to a base that follows them at once."""
    controller = MppiController(model.Mppi(type="mppi", **options), setting(robot))
    controller.set_path(Path(straight(length)))
    view, goal = view_of(length=length + 2.0), Goal("far", Pose2(length, 0.0))
    pose, twist, commands = Pose2(0.0, 0.0), Twist(), []
    for _ in range(round(seconds / PERIOD)):
        twist = controller.command(pose, twist, view, goal)
        pose = Pose2(*poses_along(pose, twist, np.array([PERIOD]))[0].tolist())
        commands.append(twist)
    return commands


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_mppi_reaches_its_desired_speed_on_a_free_straight(speed: float) -> None:
    commands = driven(round_robot(speed=2.5), 6.0 * speed + 4.0, 3.0, vx_max=speed)
    assert max(each.vx for each in commands) <= speed + 1e-6
    assert min(each.vx for each in commands[-20:]) > 0.9 * speed


def test_each_attempt_uses_the_pose_of_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    controller = MppiController(
        model.Mppi(type="mppi", iteration_count=1, retry_attempt_limit=1), setting(round_robot())
    )
    controller.set_path(Path(straight(4.0)))
    poses = []

    def collide(*_: object) -> bool:
        poses.append(controller._pose)
        return False

    monkeypatch.setattr(controller, "_iterate", collide)
    with pytest.raises(NavigationFailure):
        controller.command(Pose2(1.0, 0.2), Twist(), view_of(), Goal("far", Pose2(4.0, 0.0)))
    assert poses == [Pose2(1.0, 0.2)] * 2


def test_mppi_reaches_its_speed_with_longer_time_steps() -> None:
    commands = driven(round_robot(speed=2.5), 14.0, 3.0, vx_max=1.0, model_dt=0.1, time_steps=28)
    assert min(each.vx for each in commands[-20:]) > 0.9


def test_commands_respect_the_accelerations_of_the_base() -> None:
    robot = round_robot(speed=1.0, linear_acceleration=0.8, linear_deceleration=0.8)
    speeds = np.array([each.vx for each in driven(robot, 8.0, 1.5, vx_max=1.0, batch_size=200)])
    assert np.diff(speeds).max() <= 0.8 * PERIOD + 1e-6


def test_velocities_follow_controls_within_the_acceleration_limits() -> None:
    controls = np.array([[1.0, 1.0, -1.0, 0.0], [0.1, -5.0, 0.0, 0.0]], np.float32)[:, :, None]
    velocities = predict_velocities(np.array([0.0, 0.0], np.float32), controls, LIMITS, 0.1)[:, :, 0]
    assert velocities[0] == pytest.approx([0.0, 0.3, 0.6, 0.3], abs=1e-6)
    assert velocities[1] == pytest.approx([0.0, 0.1, -0.25, 0.0], abs=1e-6)


def test_braking_is_limited_by_the_deceleration_in_both_directions() -> None:
    limits = VelocityLimits((-2.0, 0.0, -1.0), (2.0, 0.0, 1.0), (1.0, 1.0, 1.0), (-3.0, -3.0, -1.0), 0.0)
    for sign in (1.0, -1.0):
        controls = np.zeros((2, 3, 1), np.float32)
        velocities = predict_velocities(np.array([sign, 0.0], np.float32), controls, limits, 0.1)
        assert sign * velocities[0, :, 0] == pytest.approx([1.0, 0.7, 0.4], abs=1e-6)


def test_each_step_uses_the_heading_at_its_start() -> None:
    velocities = np.array([[1.0, 1.0], [math.pi, 0.0], [0.0, 0.5]], np.float32)[:, :, None]
    rolled = integrate_velocities(velocities, 0.0, 0.5)
    assert rolled.yaw[:, 0] == pytest.approx([math.pi / 2, math.pi / 2], abs=1e-6)
    assert rolled.x[:, 0] == pytest.approx([0.5, 0.5 - 0.25], abs=1e-6)
    assert rolled.y[:, 0] == pytest.approx([0.0, 0.5], abs=1e-6)


def test_pending_commands_precede_the_sampled_ones() -> None:
    velocities = np.arange(10, dtype=np.float32).reshape(2, 5, 1)
    apply_model_delay(velocities, np.tile(np.array([6.0, 7.0, 8.0, 9.0], np.float32), (2, 1)), (3, 0))
    assert velocities[0, :, 0].tolist() == [0.0, 8.0, 9.0, 1.0, 2.0]
    assert velocities[1, :, 0].tolist() == [5.0, 6.0, 7.0, 8.0, 9.0]


@pytest.mark.parametrize("delay", range(1, 12))
def test_all_steps_of_a_sample_shorter_than_the_delay_are_pending_commands(delay: int) -> None:
    velocities, sent = np.arange(1.0, 6.0, dtype=np.float32).reshape(1, 5, 1), np.arange(-12.0, 0.0)
    apply_model_delay(velocities, sent[None].astype(np.float32), (delay,))
    undelayed = [*sent.tolist(), 2.0, 3.0, 4.0, 5.0]
    assert velocities[0, 1:, 0].tolist() == undelayed[12 - delay + 1 : 12 - delay + 5]


def test_savitzky_golay_filter_keeps_parabolas_and_reduces_noise() -> None:
    steps = np.arange(-4.0, 30.0)
    parabola = (0.01 * steps**2).astype(np.float32)
    kept = smooth_sequence(parabola[None, 4:], parabola[None, :4], 2)
    assert kept[0, :25] == pytest.approx(parabola[4:29], abs=1e-5)
    spike = np.zeros((1, 30), np.float32)
    spike[0, 10] = 1.0
    past = np.zeros((1, 4), np.float32)
    assert smooth_sequence(spike, past, 2)[0, 10] == pytest.approx(59 / 231)
    assert smooth_sequence(spike, past, 1)[0, 6:15] == pytest.approx(np.full(9, 1 / 9))


def test_sequence_too_short_to_smooth_is_unchanged() -> None:
    spike = np.eye(1, 20, dtype=np.float32)
    assert smooth_sequence(spike, np.zeros((1, 4), np.float32), 2) is spike


def test_a_car_never_turns_tighter_than_its_radius() -> None:
    car = VelocityLimits((-1.0, 0.0, -5.0), (1.0, 0.0, 5.0), (3.0, 3.0, 9.0), (-3.0, -3.0, -9.0), 2.0)
    sequence = np.array([[0.5, 0.5, 0.5], [3.0, 3.0, -3.0]], np.float32)
    kept = apply_limits(sequence, np.array([0.5, 0.0], np.float32), car, 0.05)
    assert (np.abs(kept[1]) <= np.abs(kept[0]) / 2.0 + 1e-6).all()


def test_control_sequence_is_shifted_by_fractions_of_a_step() -> None:
    sequence = np.array([[0.0, 1.0, 3.0]], np.float32)
    assert shift_sequence(sequence, 1.0)[0].tolist() == [1.0, 3.0, 3.0]
    assert shift_sequence(sequence, 0.5)[0].tolist() == [0.5, 2.0, 3.0]


def scene(velocities: np.ndarray, view: CostmapView | None = None, length: float = 3.0, **more: Any) -> CriticData:
    """Rollouts (axes, steps, n) at 0.1 s from the origin, and a plan along x with points 5 cm apart."""
    robot = round_robot()
    plan = UpcomingPath(straight(length), 0.05, length)
    rolled = integrate_velocities(velocities.astype(np.float32), 0.0, 0.1)
    text = {"pose": Pose2(0.0, 0.0), "goal_yaw": 0.0, "limits": LIMITS, "dt": 0.1, "tolerance": 0.25, **more}
    return CriticData(rolled, plan, costmap=view or view_of(), footprint=Footprint(robot, 0.05), **text)


def along(*speeds: float, steps: int = 10, turn: float = 0.0) -> np.ndarray:
    """Velocities of rollouts that go straight at these speeds."""
    vx = np.tile(np.array(speeds), (steps, 1))
    return np.stack((vx, np.full_like(vx, turn)))


def test_constraint_critic_penalizes_excess_speed() -> None:
    cost = critics.constraint_critic(model.MppiConstraintCritic(), scene(along(0.5, 0.8, -0.45)))
    assert cost == pytest.approx([0.0, 4.0 * 0.3, 4.0 * 0.1], abs=1e-5)


def test_constraint_critic_penalizes_turns_tighter_than_the_turning_radius() -> None:
    car = replace(LIMITS, turning_radius=1.0)
    cost = critics.constraint_critic(model.MppiConstraintCritic(), scene(along(0.4, turn=0.8), limits=car))
    assert cost == pytest.approx([4.0 * 0.5 * 1.0], abs=1e-5)


def test_cost_critic_is_the_mean_cost_over_254_and_a_collision_costs_a_million() -> None:
    view = view_of((1.0, -3.0, 1.2, 3.0))
    spec = model.MppiCostCritic(near_goal_distance=0.0, trajectory_point_step=1)
    seen = scene(along(0.0, 0.5, 1.5), view)
    cost, hit = critics.cost_critic(spec, seen)
    costs = seen.costs(seen.lookup(seen.rollouts.x, seen.rollouts.y))
    assert hit.tolist() == [False, False, True]
    assert cost[1] == pytest.approx(3.81 / 254 * costs[:, 1].mean(), rel=1e-5)
    assert cost[2] == pytest.approx(3.81 / 254 / 10 * 1e6, rel=1e-5)


def test_cost_critic_near_the_goal_penalizes_only_near_collisions() -> None:
    view = view_of((1.0, -3.0, 1.2, 3.0))
    cost, _ = critics.cost_critic(model.MppiCostCritic(), scene(along(0.5), view, length=0.9))
    assert cost == pytest.approx([0.0])
    cost, _ = critics.cost_critic(model.MppiCostCritic(near_collision_cost=20), scene(along(0.5), view, length=0.9))
    assert cost[0] > 1.0


def test_obstacles_critic_penalizes_distances_below_its_margin() -> None:
    view = view_of((1.0, -3.0, 1.2, 3.0))
    seen = scene(along(0.7), view)
    cells = seen.lookup(seen.rollouts.x, seen.rollouts.y)
    gap = seen.clearance(cells, seen.rollouts.yaw, consider_footprint=True)[:, 0]
    cost, hit = critics.obstacles_critic(model.MppiObstaclesCritic(repulsion_weight=0.0), seen)
    assert not hit.any()
    assert cost[0] == pytest.approx(20.0 * np.clip(0.1 - gap, 0, None).sum(), rel=1e-4)


def test_robot_in_collision_may_leave_but_not_penetrate_further() -> None:
    view = view_of((0.15, -3.0, 1.0, 3.0))
    _, hit = critics.cost_critic(model.MppiCostCritic(), scene(along(0.4, -0.4), view))
    assert hit.tolist() == [True, False]


def test_robot_whose_discs_touch_an_obstacle_may_drive_along_it() -> None:
    robot = box_robot()
    everywhere = np.full((60, 60), 0.16, np.float32)
    view = CostmapView(np.zeros((60, 60), np.uint8), everywhere, 0.05, (-1.5, -1.5))
    seen = replace(scene(along(0.3), view), footprint=Footprint(robot, 0.05))
    gap = seen.clearance(seen.lookup(seen.rollouts.x, seen.rollouts.y), seen.rollouts.yaw, consider_footprint=True)
    assert gap.max() < 0.0 < Footprint(robot, 0.05).clearance(view, np.array([seen.pose]))[0]
    _, hit = critics.cost_critic(model.MppiCostCritic(), seen)
    assert not hit.any()


def test_goal_critic_is_the_mean_distance_to_the_end_of_the_plan() -> None:
    cost = critics.goal_critic(model.MppiGoalCritic(), scene(along(0.5), length=1.0))
    assert cost == pytest.approx([5.0 * np.mean(1.0 - 0.05 * np.arange(1, 11))], rel=1e-5)


def test_goal_angle_critic_is_the_mean_angle_also_for_symmetric_robots() -> None:
    turning = scene(along(0.0), length=0.3, goal_yaw=math.pi - 0.2)
    assert critics.goal_angle_critic(model.MppiGoalAngleCritic(), turning) == pytest.approx([3.0 * (math.pi - 0.2)])
    either = model.MppiGoalAngleCritic(symmetric_yaw_tolerance=True)
    assert critics.goal_angle_critic(either, turning) == pytest.approx([3.0 * 0.2], rel=1e-4)


def test_furthest_reached_point_is_the_nearest_to_the_end_of_a_rollout() -> None:
    assert scene(along(0.2, 0.5)).furthest_point == 10 - 1


def test_path_align_critic_compares_at_equal_driven_distance() -> None:
    beside = along(1.0, steps=17, turn=0.0)
    seen = scene(beside)
    offset = CriticData(
        Rollouts(seen.rollouts.x, seen.rollouts.y + np.float32(0.3), seen.rollouts.yaw, seen.rollouts.velocities),
        *(getattr(seen, name) for name in ("plan", "pose", "goal_yaw", "costmap", "footprint", "limits", "dt")), 0.25,
    )  # fmt: skip
    cost = critics.path_align_critic(model.MppiPathAlignCritic(), offset)
    # Meters are counted from the first pose looked at, 0.1 m from the plan's first point: so it is 0.1 m ahead, too;
    # the last is compared with the point before the furthest.
    mean = (3 * math.hypot(0.3, 0.1) + math.hypot(0.3, 0.15)) / 4
    assert cost == pytest.approx([14.0 * mean], rel=1e-3)


def test_path_align_critic_is_inactive_at_the_start_and_where_the_plan_is_blocked() -> None:
    assert critics.path_align_critic(model.MppiPathAlignCritic(), scene(along(0.1))) is None
    blocked = scene(along(1.5), view_of((0.9, -0.1, 1.1, 0.1)))
    assert critics.path_align_critic(model.MppiPathAlignCritic(), blocked) is None


def test_path_follow_critic_is_the_distance_to_a_free_point_beyond_the_furthest() -> None:
    cost = critics.path_follow_critic(model.MppiPathFollowCritic(), scene(along(0.5, 0.2)))
    assert cost == pytest.approx([5.0 * (0.45 + 0.25 - 0.5), 5.0 * (0.70 - 0.2)], rel=1e-3)


@pytest.mark.parametrize(("mode", "weighed"), [(0, math.pi), (1, None), (2, math.pi)])
def test_path_angle_critic_allows_reversing_robots_to_face_backward(mode: int, weighed: float | None) -> None:
    turned = scene(along(0.0), pose=Pose2(0.0, 0.0, math.pi))
    back = integrate_velocities(along(0.0).astype(np.float32), math.pi, 0.1)
    turned = replace(turned, rollouts=back)
    cost = critics.path_angle_critic(model.MppiPathAngleCritic(mode=mode), turned)
    assert cost is None if weighed is None else cost == pytest.approx([2.0 * weighed], rel=1e-5)


def test_prefer_forward_critic_penalizes_distance_driven_backward() -> None:
    cost = critics.prefer_forward_critic(model.MppiPreferForwardCritic(), scene(along(0.3, -0.2)))
    assert cost == pytest.approx([0.0, 5.0 * 0.2], abs=1e-6)


def test_velocity_deadband_critic_penalizes_velocities_below_the_deadband() -> None:
    spec = model.MppiVelocityDeadbandCritic(deadband_velocities=(0.2, 0.3, 0.4))
    cost = critics.velocity_deadband_critic(spec, scene(along(0.05, -0.25, turn=-0.1)))
    assert cost == pytest.approx([35.0 * (0.15 + 0.3), 35.0 * 0.3], rel=1e-5)
    strafing = np.concatenate((along(0.05, turn=-0.1), np.full((1, 10, 1), 0.1)))
    assert critics.velocity_deadband_critic(spec, scene(strafing)) == pytest.approx(
        [35.0 * (0.15 + 0.3 + 0.2)], rel=1e-5
    )


def test_twirling_critic_is_the_mean_turn_rate() -> None:
    assert critics.twirling_critic(model.MppiTwirlingCritic(), scene(along(0.3, turn=-0.5))) == pytest.approx([5.0])


@pytest.mark.parametrize("order", [("CostCritic", "ObstaclesCritic"), ("ObstaclesCritic", "CostCritic")])
def test_rollouts_collide_if_any_critic_says_so(order: tuple[model.CriticName, ...]) -> None:
    circle = model.MppiObstaclesCritic(consider_footprint=False)
    spec = model.Mppi(type="mppi", critics=list(order), ObstaclesCritic=circle)
    data = replace(scene(along(0.8), view_of((0.5, 0.2, 1.0, 0.4))), footprint=Footprint(box_robot(width=0.36), 0.05))
    assert not critics.obstacles_critic(circle, data)[1].any()
    assert critics.cost_critic(spec.CostCritic, data)[1].all()
    assert critics.CriticManager(spec, is_omni=False).costs(data)[1]
