"""Tests of MPPI: speeds in drives, rollouts, control sequences, and critics, with values computed by hand."""

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

PERIOD_S = 0.05
LIMITS = VelocityLimits((-0.35, -0.5, -1.9), (0.5, 0.5, 1.9), (3.0, 3.0, 3.5), (-3.0, -3.0, -3.5), 0.0)


def view_of(*boxes: tuple[float, float, float, float], length: float = 12.0) -> CostmapView:
    grid = Flatland(list(boxes)).grid((-2.0, -3.0, length, 3.0))
    return LayeredCostmap(CostmapSpec(), Surroundings(round_robot(), grid, TICK_RATE_HZ)).view


def straight(length: float) -> np.ndarray:
    x = np.arange(0.0, length + 1e-9, 0.05)
    return np.column_stack((x, np.zeros_like(x), np.zeros_like(x)))


def commands_on_straight_path(robot: RobotModel, length: float, seconds: float, **options: Any) -> list[Twist]:
    """Return the commands on a straight path in free space, for a base that executes commands without delay."""
    controller = MppiController(model.Mppi(type="mppi", **options), setting(robot))
    controller.set_path(Path(straight(length)))
    view, goal = view_of(length=length + 2.0), Goal("far", Pose2(length, 0.0))
    pose, twist, commands = Pose2(0.0, 0.0), Twist(), []
    for _ in range(round(seconds / PERIOD_S)):
        twist = controller.command(pose, twist, view, goal)
        pose = Pose2(*poses_along(pose, twist, np.array([PERIOD_S]))[0].tolist())
        commands.append(twist)
    return commands


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_mppi_reaches_its_desired_speed_on_a_straight_path(speed: float) -> None:
    commands = commands_on_straight_path(round_robot(speed=2.5), 6.0 * speed + 4.0, 3.0, vx_max=speed)
    assert max(command.vx for command in commands) <= speed + 1e-6
    assert min(command.vx for command in commands[-20:]) > 0.9 * speed


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
    commands = commands_on_straight_path(round_robot(speed=2.5), 14.0, 3.0, vx_max=1.0, model_dt=0.1, time_steps=28)
    assert min(command.vx for command in commands[-20:]) > 0.9


def test_commands_respect_the_accelerations_of_the_base() -> None:
    robot = round_robot(speed=1.0, linear_acceleration=0.8, linear_deceleration=0.8)
    commands = commands_on_straight_path(robot, 8.0, 1.5, vx_max=1.0, batch_size=200)
    speeds = np.array([command.vx for command in commands])
    assert np.diff(speeds).max() <= 0.8 * PERIOD_S + 1e-6


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
    rollouts = integrate_velocities(velocities, 0.0, 0.5)
    assert rollouts.yaw[:, 0] == pytest.approx([math.pi / 2, math.pi / 2], abs=1e-6)
    assert rollouts.x[:, 0] == pytest.approx([0.5, 0.5 - 0.25], abs=1e-6)
    assert rollouts.y[:, 0] == pytest.approx([0.0, 0.5], abs=1e-6)


def test_pending_commands_precede_sampled_commands() -> None:
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
    smoothed = smooth_sequence(parabola[None, 4:], parabola[None, :4], 2)
    assert smoothed[0, :25] == pytest.approx(parabola[4:29], abs=1e-5)
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
    limited = apply_limits(sequence, np.array([0.5, 0.0], np.float32), car, 0.05)
    assert (np.abs(limited[1]) <= np.abs(limited[0]) / 2.0 + 1e-6).all()


def test_control_sequence_is_shifted_by_fractions_of_a_step() -> None:
    sequence = np.array([[0.0, 1.0, 3.0]], np.float32)
    assert shift_sequence(sequence, 1.0)[0].tolist() == [1.0, 3.0, 3.0]
    assert shift_sequence(sequence, 0.5)[0].tolist() == [0.5, 2.0, 3.0]


def scene(velocities: np.ndarray, view: CostmapView | None = None, length: float = 3.0, **options: Any) -> CriticData:
    """Return rollouts of velocities (axes, steps, n) at steps of 0.1 s, and a plan along x with a point every 5 cm."""
    robot = round_robot()
    plan = UpcomingPath(straight(length), 0.05, length)
    rollouts = integrate_velocities(velocities.astype(np.float32), 0.0, 0.1)
    arguments = {"pose": Pose2(0.0, 0.0), "goal_yaw": 0.0, "limits": LIMITS, "dt": 0.1, "tolerance": 0.25, **options}
    return CriticData(rollouts, plan, costmap=view or view_of(), footprint=Footprint(robot, 0.05), **arguments)


def forward_velocities(*speeds: float, steps: int = 10, turn: float = 0.0) -> np.ndarray:
    """Return the velocities of rollouts at these speeds in m/s, and with the turn rate `turn` in rad/s."""
    vx = np.tile(np.array(speeds), (steps, 1))
    return np.stack((vx, np.full_like(vx, turn)))


def test_constraint_critic_penalizes_excess_speed() -> None:
    cost = critics.constraint_critic(model.MppiConstraintCritic(), scene(forward_velocities(0.5, 0.8, -0.45)))
    assert cost == pytest.approx([0.0, 4.0 * 0.3, 4.0 * 0.1], abs=1e-5)


def test_constraint_critic_penalizes_turns_tighter_than_the_turning_radius() -> None:
    car = replace(LIMITS, turning_radius=1.0)
    cost = critics.constraint_critic(model.MppiConstraintCritic(), scene(forward_velocities(0.4, turn=0.8), limits=car))
    assert cost == pytest.approx([4.0 * 0.5 * 1.0], abs=1e-5)


def test_cost_critic_is_the_mean_cost_divided_by_254_and_a_collision_costs_a_million() -> None:
    view = view_of((1.0, -3.0, 1.2, 3.0))
    spec = model.MppiCostCritic(near_goal_distance=0.0, trajectory_point_step=1)
    data = scene(forward_velocities(0.0, 0.5, 1.5), view)
    cost, hit = critics.cost_critic(spec, data)
    costs = data.costs(data.lookup(data.rollouts.x, data.rollouts.y))
    assert hit.tolist() == [False, False, True]
    assert cost[1] == pytest.approx(3.81 / 254 * costs[:, 1].mean(), rel=1e-5)
    assert cost[2] == pytest.approx(3.81 / 254 / 10 * 1e6, rel=1e-5)


def test_cost_critic_near_the_goal_penalizes_only_near_collisions() -> None:
    view = view_of((1.0, -3.0, 1.2, 3.0))
    cost, _ = critics.cost_critic(model.MppiCostCritic(), scene(forward_velocities(0.5), view, length=0.9))
    assert cost == pytest.approx([0.0])
    cost, _ = critics.cost_critic(
        model.MppiCostCritic(near_collision_cost=20), scene(forward_velocities(0.5), view, length=0.9)
    )
    assert cost[0] > 1.0


def test_obstacles_critic_penalizes_distances_below_its_margin() -> None:
    view = view_of((1.0, -3.0, 1.2, 3.0))
    data = scene(forward_velocities(0.7), view)
    cells = data.lookup(data.rollouts.x, data.rollouts.y)
    gap = data.clearance(cells, data.rollouts.yaw, consider_footprint=True)[:, 0]
    cost, hit = critics.obstacles_critic(model.MppiObstaclesCritic(repulsion_weight=0.0), data)
    assert not hit.any()
    assert cost[0] == pytest.approx(20.0 * np.clip(0.1 - gap, 0, None).sum(), rel=1e-4)


def test_robot_in_collision_may_leave_but_not_move_deeper() -> None:
    view = view_of((0.15, -3.0, 1.0, 3.0))
    _, hit = critics.cost_critic(model.MppiCostCritic(), scene(forward_velocities(0.4, -0.4), view))
    assert hit.tolist() == [True, False]


def test_robot_whose_discs_touch_an_obstacle_may_drive_along_it() -> None:
    robot = box_robot()
    distance = np.full((60, 60), 0.16, np.float32)
    view = CostmapView(np.zeros((60, 60), np.uint8), distance, 0.05, (-1.5, -1.5))
    data = replace(scene(forward_velocities(0.3), view), footprint=Footprint(robot, 0.05))
    gap = data.clearance(data.lookup(data.rollouts.x, data.rollouts.y), data.rollouts.yaw, consider_footprint=True)
    assert gap.max() < 0.0 < Footprint(robot, 0.05).clearance(view, np.array([data.pose]))[0]
    _, hit = critics.cost_critic(model.MppiCostCritic(), data)
    assert not hit.any()


def test_goal_critic_is_the_mean_distance_to_the_end_of_the_plan() -> None:
    cost = critics.goal_critic(model.MppiGoalCritic(), scene(forward_velocities(0.5), length=1.0))
    assert cost == pytest.approx([5.0 * np.mean(1.0 - 0.05 * np.arange(1, 11))], rel=1e-5)


def test_goal_angle_critic_is_the_mean_angle_to_the_goal_or_to_the_opposite_heading() -> None:
    data = scene(forward_velocities(0.0), length=0.3, goal_yaw=math.pi - 0.2)
    assert critics.goal_angle_critic(model.MppiGoalAngleCritic(), data) == pytest.approx([3.0 * (math.pi - 0.2)])
    symmetric = model.MppiGoalAngleCritic(symmetric_yaw_tolerance=True)
    assert critics.goal_angle_critic(symmetric, data) == pytest.approx([3.0 * 0.2], rel=1e-4)


def test_furthest_point_of_the_plan_is_the_nearest_to_the_end_of_any_rollout() -> None:
    assert scene(forward_velocities(0.2, 0.5)).furthest_point == 10 - 1


def test_path_align_critic_compares_at_equal_driven_distance() -> None:
    velocities = forward_velocities(1.0, steps=17, turn=0.0)
    data = scene(velocities)
    offset = CriticData(
        Rollouts(data.rollouts.x, data.rollouts.y + np.float32(0.3), data.rollouts.yaw, data.rollouts.velocities),
        *(getattr(data, name) for name in ("plan", "pose", "goal_yaw", "costmap", "footprint", "limits", "dt")), 0.25,
    )  # fmt: skip
    cost = critics.path_align_critic(model.MppiPathAlignCritic(), offset)
    # Distances are counted from the first pose of the rollout, which is 0.1 m beyond the first point of the plan. The
    # last pose is compared with the point before the furthest one.
    mean = (3 * math.hypot(0.3, 0.1) + math.hypot(0.3, 0.15)) / 4
    assert cost == pytest.approx([14.0 * mean], rel=1e-3)


def test_path_align_critic_is_inactive_at_the_start_and_where_the_plan_is_blocked() -> None:
    assert critics.path_align_critic(model.MppiPathAlignCritic(), scene(forward_velocities(0.1))) is None
    blocked = scene(forward_velocities(1.5), view_of((0.9, -0.1, 1.1, 0.1)))
    assert critics.path_align_critic(model.MppiPathAlignCritic(), blocked) is None


def test_path_follow_critic_is_the_distance_to_a_free_point_beyond_the_furthest_point() -> None:
    cost = critics.path_follow_critic(model.MppiPathFollowCritic(), scene(forward_velocities(0.5, 0.2)))
    assert cost == pytest.approx([5.0 * (0.45 + 0.25 - 0.5), 5.0 * (0.70 - 0.2)], rel=1e-3)


@pytest.mark.parametrize(("mode", "angle"), [(0, math.pi), (1, None), (2, math.pi)])
def test_path_angle_critic_allows_reversing_robots_to_face_backward(mode: int, angle: float | None) -> None:
    data = scene(forward_velocities(0.0), pose=Pose2(0.0, 0.0, math.pi))
    rollouts = integrate_velocities(forward_velocities(0.0).astype(np.float32), math.pi, 0.1)
    data = replace(data, rollouts=rollouts)
    cost = critics.path_angle_critic(model.MppiPathAngleCritic(mode=mode), data)
    assert cost is None if angle is None else cost == pytest.approx([2.0 * angle], rel=1e-5)


def test_prefer_forward_critic_penalizes_distance_driven_backward() -> None:
    cost = critics.prefer_forward_critic(model.MppiPreferForwardCritic(), scene(forward_velocities(0.3, -0.2)))
    assert cost == pytest.approx([0.0, 5.0 * 0.2], abs=1e-6)


def test_velocity_deadband_critic_penalizes_velocities_below_the_deadband() -> None:
    spec = model.MppiVelocityDeadbandCritic(deadband_velocities=(0.2, 0.3, 0.4))
    cost = critics.velocity_deadband_critic(spec, scene(forward_velocities(0.05, -0.25, turn=-0.1)))
    assert cost == pytest.approx([35.0 * (0.15 + 0.3), 35.0 * 0.3], rel=1e-5)
    strafing = np.concatenate((forward_velocities(0.05, turn=-0.1), np.full((1, 10, 1), 0.1)))
    assert critics.velocity_deadband_critic(spec, scene(strafing)) == pytest.approx(
        [35.0 * (0.15 + 0.3 + 0.2)], rel=1e-5
    )


def test_twirling_critic_is_the_mean_turn_rate() -> None:
    assert critics.twirling_critic(
        model.MppiTwirlingCritic(), scene(forward_velocities(0.3, turn=-0.5))
    ) == pytest.approx([5.0])


@pytest.mark.parametrize("order", [("CostCritic", "ObstaclesCritic"), ("ObstaclesCritic", "CostCritic")])
def test_rollouts_are_invalid_if_any_critic_detects_a_collision(order: tuple[model.CriticName, ...]) -> None:
    circle = model.MppiObstaclesCritic(consider_footprint=False)
    spec = model.Mppi(type="mppi", critics=list(order), ObstaclesCritic=circle)
    data = replace(
        scene(forward_velocities(0.8), view_of((0.5, 0.2, 1.0, 0.4))), footprint=Footprint(box_robot(width=0.36), 0.05)
    )
    assert not critics.obstacles_critic(circle, data)[1].any()
    assert critics.cost_critic(spec.CostCritic, data)[1].all()
    assert critics.CriticManager(spec, is_omni=False).costs(data)[1]
