"""Tests of the recovery behavior `retrace`, which follows the robot's own trail backward."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from simscen.advanced import spec as model
from simscen.advanced.retrace import Retrace
from simscen.advanced.trail import Trail
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.core.messages.sensor_data import Scan
from simscen.model import recovery
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.model.velocity_commands import CollisionMonitor as MonitorSpec
from simscen.stack.behaviors import BackUp, Spin
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.kinematics import poses_along
from simscen.stack.protocols import Behavior, CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, box_robot, round_robot, setting

Limit = Callable[[Twist, Pose2], Twist]
SQUARE = box_robot(0.42, 0.42)
"""Square robot with an edge of 0.42 m."""
POSTS = ((0.29, -0.03, 0.05), (-0.4, 0.17, 0.05))
"""Discs (x, y, radius) between which Nav2's spin and backup fail for a robot at the origin."""


def view_of(robot: RobotModel, world: Flatland) -> CostmapView:
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid((-3.0, -3.0, 3.0, 3.0)), TICK_RATE_HZ)).view


def poses_of_drive(*legs: tuple[Twist, float]) -> list[Pose2]:
    """Return the poses, at 40 Hz, of a drive that ends at the origin; `legs` are velocities and durations in s."""
    pose, path = Pose2(0.0, 0.0), [Pose2(0.0, 0.0)]
    for twist, seconds in legs:
        steps = poses_along(pose, twist, np.arange(1, round(40 * seconds) + 1) / 40)
        path += [Pose2(*row) for row in steps.tolist()]
        pose = path[-1]
    origin_from_end = path[-1].inverse()
    return [origin_from_end.compose(pose) for pose in path]


ENTRY = poses_of_drive((Twist(0.3, 0.0, 0.0), 2.0), (Twist(0.2, 0.0, -0.8), 1.0), (Twist(0.0, 0.0, -0.5), 0.4))
"""Straight, a bend to the right, and a small turn in place."""


def behavior(robot: RobotModel, path: list[Pose2], **options: float) -> Retrace:
    return Retrace(model.Retrace(**options), replace(setting(robot), trail=lambda: path))


def run(
    behavior: Behavior, view: CostmapView, slip: float = 1.0, limit: Limit = lambda command, _: command
) -> list[Pose2]:
    """Return the poses until the behavior ends; `limit` limits its commands, and `slip` scales its turns."""
    poses = [Pose2(0.0, 0.0)]
    behavior.start(poses[0])
    for beat in range(400):
        command = behavior.step(poses[-1], view, 0.05 * beat)
        if command is None:
            return poses
        executed = limit(command, poses[-1])
        motion = Twist(executed.vx, executed.vy, slip * executed.wz)
        poses.append(Pose2(*poses_along(poses[-1], motion, np.array([0.05]))[0].tolist()))
    raise AssertionError("the behavior does not end")


@pytest.mark.parametrize("slip", [1.0, 0.7])
def test_retrace_frees_a_robot_wedged_between_posts(slip: float) -> None:
    world = Flatland(discs=list(POSTS))
    view = view_of(SQUARE, world)
    for nav2_behavior in (
        Spin(recovery.Spin(), setting(SQUARE)),
        BackUp(recovery.BackUp(backup_partial=False), setting(SQUARE)),
    ):
        with pytest.raises(NavigationFailure):
            run(nav2_behavior, view)
    poses = run(behavior(SQUARE, ENTRY), view, slip)
    assert min(world.clearance(SQUARE, pose) for pose in poses) > 0.0
    assert min(poses[-1].distance(pose) for pose in ENTRY) < 0.1
    assert world.distance(np.array([poses[-1][:2]]))[0] > SQUARE.circumscribed_radius - view.resolution / 2
    assert abs(poses[-1].yaw) > 0.3


def test_retrace_reverses_turns_in_place() -> None:
    poses = run(behavior(SQUARE, ENTRY), view_of(SQUARE, Flatland()))
    turned = next(pose for pose in poses if pose.yaw > 0.15)
    assert turned.distance(poses[0]) < 0.03


def test_retrace_distance_depends_on_the_free_space() -> None:
    straight = poses_of_drive((Twist(0.5, 0.0, 0.0), 6.0))
    corridor = Flatland([(-3.0, 0.27, 3.0, 0.4), (-3.0, -0.4, 3.0, -0.27)])
    assert run(behavior(SQUARE, straight), view_of(SQUARE, Flatland()))[-1].x == pytest.approx(-0.30, abs=0.03)
    assert run(behavior(SQUARE, straight), view_of(SQUARE, corridor))[-1].x == pytest.approx(-1.0, abs=0.03)
    shorter = behavior(SQUARE, straight, retrace_dist=0.5)
    assert run(shorter, view_of(SQUARE, corridor))[-1].x == pytest.approx(-0.5, abs=0.03)


def test_retrace_without_a_trail_backs_up_straight() -> None:
    end = run(behavior(SQUARE, []), view_of(SQUARE, Flatland()))[-1]
    assert (end.x, end.y, end.yaw) == pytest.approx((-0.30, 0.0, 0.0), abs=0.03)


def test_retrace_of_a_lateral_motion_is_lateral() -> None:
    base = replace(SQUARE, max_lateral=0.5)
    end = run(behavior(base, poses_of_drive((Twist(0.0, 0.3, 0.0), 3.0))), view_of(base, Flatland()))[-1]
    assert (end.x, end.y, end.yaw) == pytest.approx((0.0, -0.30, 0.0), abs=0.03)


def test_obstacle_on_the_trail_ends_retrace() -> None:
    straight = poses_of_drive((Twist(0.5, 0.0, 0.0), 6.0))
    end = run(behavior(SQUARE, straight), view_of(SQUARE, Flatland([(-0.6, -1.0, -0.4, 1.0)])))[-1]
    assert -0.19 < end.x < -0.05
    with pytest.raises(NavigationFailure) as failure:
        run(behavior(SQUARE, straight), view_of(SQUARE, Flatland([(-0.6, -1.0, -0.26, 1.0)])))
    assert failure.value.code == ErrorCode.BACKUP_COLLISION_AHEAD


def test_retrace_has_the_error_codes_of_backup() -> None:
    retrace, view = behavior(SQUARE, ENTRY), view_of(SQUARE, Flatland())
    retrace.start(Pose2(0.0, 0.0))
    with pytest.raises(NavigationFailure) as failure:
        retrace.step(Pose2(0.0, 0.0), view, 10.1)
    assert failure.value.code == ErrorCode.BACKUP_TIMEOUT
    with pytest.raises(NavigationFailure) as failure:
        run(behavior(replace(SQUARE, max_reverse=0.0), ENTRY), view)
    assert failure.value.code == ErrorCode.BACKUP_INVALID_INPUT


def test_retrace_sends_only_commands_that_the_collision_monitor_allows() -> None:
    path = poses_of_drive((Twist(0.3, 0.0, 0.0), 2.0), (Twist(0.2, 0.0, -0.8), 1.0))
    ranges = np.full(5, 9.0)
    ranges[2] = math.hypot(0.02, 0.217)  # a post 7 mm beside the hull, toward which the trail turns
    monitor = CollisionMonitor(MonitorSpec(), SQUARE, ("lidar",), TICK_RATE_HZ)
    monitor.on_scan(Scan("lidar", 0, ranges, math.atan2(0.217, 0.02) - 0.02, 0.01, 0.1, 10.0), Pose2(0.0, 0.0))
    view = view_of(SQUARE, Flatland())
    with pytest.raises(NavigationFailure, match="too long"):
        run(behavior(SQUARE, path), view, limit=monitor.limit_command)
    limited = Retrace(
        model.Retrace(), replace(setting(SQUARE), trail=lambda: path, limit_command=monitor.limit_command)
    )
    end = run(limited, view, limit=monitor.limit_command)[-1]
    assert math.hypot(end.x, end.y) > 0.29 and end.yaw > 0.3


def test_retrace_continues_from_a_pose_next_to_the_trail() -> None:
    corridor = Flatland([(-4.0, 0.27, 3.0, 0.4), (-4.0, -0.4, 3.0, -0.27)])
    path = poses_of_drive((Twist(0.5, 0.0, 0.0), 6.0))
    retrace, view = behavior(SQUARE, path), view_of(SQUARE, corridor)
    retraced = run(retrace, view)
    shifted = [Pose2(pose.x, pose.y + 0.16, pose.yaw) for pose in (retraced[-1], retraced[-1])]
    path += [*retraced, *shifted]
    retrace.start(shifted[-1])
    command = retrace.step(shifted[-1], view_of(SQUARE, Flatland()), 0.0)
    assert command is not None and command.vx < 0.0


def test_trail_has_small_steps_without_oscillations() -> None:
    oscillation = poses_of_drive(
        (Twist(0.5, 0, 0), 2.0), (Twist(-0.2, 0, 0), 1.0), (STOP, 5.0), (Twist(0.2, 0, 0), 1.0)
    )
    trail = Trail(oscillation, oscillation[-1], 0.3, 2.0)
    assert trail.base_distances[-1] == pytest.approx(trail.poses[0, 0] - trail.poses[-1, 0], abs=0.01)
    assert np.diff(trail.poses[:, 0]).max() < 0.0
    assert np.diff(trail.footprint_distances).max() < 0.1


def test_round_robot_retraces() -> None:
    path = poses_of_drive((Twist(0.3, 0.0, 0.6), 2.0))
    end = run(behavior(round_robot(), path), view_of(round_robot(), Flatland()))[-1]
    assert min(end.distance(pose) for pose in path) < 0.03
    assert end.yaw == pytest.approx(-0.6, abs=0.1)
    assert math.hypot(end.x, end.y) == pytest.approx(0.30, abs=0.03)


def test_retrace_fails_after_its_time_allowance_of_at_least_10_s() -> None:
    view = view_of(SQUARE, Flatland())
    for allowance, seconds, fails in ((10.0, 10.05, True), (10.0, 9.9, False), (30.0, 20.0, False), (1.0, 9.9, False)):
        retrace = behavior(SQUARE, ENTRY, time_allowance=allowance, retrace_dist=1.0, backup_speed=0.15)
        retrace.start(Pose2(0.0, 0.0))
        if not fails:
            assert retrace.step(Pose2(0.0, 0.0), view, seconds) is not None
            continue
        with pytest.raises(NavigationFailure) as failure:
            retrace.step(Pose2(0.0, 0.0), view, seconds)
        assert failure.value.code is ErrorCode.BACKUP_TIMEOUT
