"""Tests of the collision monitor: speed limits by the time before a collision, and silent lidars."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.sensor_data import Scan
from simscen.model.velocity_commands import CollisionMonitor as MonitorSpec
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.moving_obstacles import MovingObstacle, MovingObstacles
from simscen.stack.protocols import RobotModel
from simscen.testing.flatland import TICK_RATE_HZ, box_robot, round_robot


def scan(*points: tuple[float, float], tick: int = 0) -> Scan:
    """Return a scan with one hit at each point, of a lidar at the origin of the base."""
    angles = np.array([math.atan2(y, x) for x, y in points])
    step = 1e-3
    ranges = np.full(7000, np.inf)
    ranges[np.round((angles + 3.5) / step).astype(int)] = [math.hypot(x, y) for x, y in points]
    return Scan("lidar", tick, ranges, -3.5, step, 0.05, 12.0)


def monitor(robot: RobotModel | None = None, **options: float) -> CollisionMonitor:
    return CollisionMonitor(MonitorSpec(**options), robot or round_robot(), ("lidar",), TICK_RATE_HZ)


@pytest.mark.parametrize(("x", "scale"), [(2.0, 1.0), (0.22 + 0.02 + 0.125, 0.5), (0.23, 0.0)])
def test_monitor_limits_the_speed_by_the_time_before_collision(x: float, scale: float) -> None:
    collision_monitor = monitor()
    collision_monitor.on_scan(scan((x, 0.0)), Pose2(0, 0))
    allowed = collision_monitor.limit_command(Twist(0.5, 0.0, 0.0), Pose2(0, 0))
    assert allowed.vx == pytest.approx(0.5 * scale, abs=0.5 / 8)
    assert allowed.vx <= 0.5 * scale + 1e-9 or scale == 1.0


def test_monitor_allows_driving_away_from_a_near_obstacle() -> None:
    collision_monitor = monitor()
    collision_monitor.on_scan(scan((0.23, 0.0)), Pose2(0, 0))
    assert collision_monitor.limit_command(Twist(-0.2), Pose2(0, 0)) == Twist(-0.2)
    assert collision_monitor.limit_command(Twist(wz=1.0), Pose2(0, 0)) == Twist(wz=1.0)


def test_monitor_includes_the_motion_since_the_scan() -> None:
    collision_monitor = monitor()
    collision_monitor.on_scan(scan((0.6, 0.0)), Pose2(5, 5, 1.0))
    assert collision_monitor.limit_command(Twist(0.2), Pose2(5, 5, 1.0)) == Twist(0.2)
    moved = Pose2(5, 5, 1.0).compose(Pose2(0.36, 0.0))
    assert collision_monitor.limit_command(Twist(0.2), moved) == STOP


def test_monitor_checks_the_corners_of_a_turning_rectangular_robot() -> None:
    collision_monitor = monitor(box_robot())
    collision_monitor.on_scan(scan((0.15, 0.19)), Pose2(0, 0))
    assert collision_monitor.limit_command(Twist(wz=1.0), Pose2(0, 0)).wz < 0.5
    assert collision_monitor.limit_command(Twist(0.3), Pose2(0, 0)).vx == 0.3


def test_monitor_can_require_several_points() -> None:
    collision_monitor = monitor(min_points=3)
    collision_monitor.on_scan(scan((0.3, 0.0), (0.3, 0.01)), Pose2(0, 0))
    assert collision_monitor.limit_command(Twist(0.5), Pose2(0, 0)) == Twist(0.5)
    collision_monitor.on_scan(scan((0.3, 0.0), (0.3, 0.01), (0.3, -0.01)), Pose2(0, 0))
    assert collision_monitor.limit_command(Twist(0.5), Pose2(0, 0)).vx < 0.5


def test_lidar_is_silent_after_its_timeout_without_scans_or_with_scans_without_returns() -> None:
    collision_monitor = monitor(source_timeout=0.3)
    collision_monitor.start(0)
    collision_monitor.on_scan(scan((2.0, 0.0)), Pose2(0, 0))
    assert not collision_monitor.is_silent(72)
    assert collision_monitor.is_silent(73)
    collision_monitor.on_scan(scan((2.0, 0.0), tick=100), Pose2(0, 0))
    assert not collision_monitor.is_silent(172)
    collision_monitor.on_scan(Scan("lidar", 180, np.full(9, np.nan), 0.0, 0.1, 0.05, 12.0), Pose2(0, 0))
    assert collision_monitor.is_silent(181)


def test_lidar_is_silent_until_its_first_scan() -> None:
    collision_monitor = monitor(source_timeout=0.3)
    collision_monitor.start(12)
    assert collision_monitor.is_silent(12)
    assert collision_monitor.silence_reason(24) == "lidar `lidar` has been silent for 0.05 s; source_timeout is 0.3 s"
    collision_monitor.on_scan(scan((2.0, 0.0), tick=10), Pose2(0, 0), 30)
    assert not collision_monitor.is_silent(30)
    collision_monitor.start(60)
    assert not collision_monitor.is_silent(60)


def test_reason_names_the_lidar_and_why_it_is_silent() -> None:
    collision_monitor = monitor(source_timeout=0.3)
    collision_monitor.start(0)
    assert collision_monitor.silence_reason(240) == "lidar `lidar` has been silent for 1.00 s; source_timeout is 0.3 s"
    collision_monitor.on_scan(scan((2.0, 0.0), tick=120), Pose2(0, 0), 240)
    assert (
        collision_monitor.silence_reason(241)
        == "scans of lidar `lidar` are 0.50 s old when they arrive; source_timeout is 0.3 s"
    )
    collision_monitor.on_scan(Scan("lidar", 300, np.full(9, np.nan), 0.0, 0.1, 0.05, 12.0), Pose2(0, 0), 300)
    assert "blind for 0.75 s: its scans contain no returns" in collision_monitor.silence_reason(300)
    assert "silent" in collision_monitor.silence_reason(400)


@pytest.mark.parametrize("robot", [round_robot(), box_robot(1.0, 0.3)])
def test_quick_check_brakes_for_moving_obstacles_like_the_full_check(
    robot: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_quick_check, without_quick_check = (CollisionMonitor(MonitorSpec(), robot, (), TICK_RATE_HZ) for _ in range(2))
    monkeypatch.setattr(without_quick_check, "_may_meet_moving", lambda *_: True)
    rng, braked_count, skipped_count = np.random.default_rng(4), 0, 0
    for _ in range(400):
        positions, velocities = rng.normal(0.0, 1.2, (2, 2)), rng.normal(0.0, 0.7, (2, 2))
        states = zip(positions, velocities, (0.3, 0.1), strict=True)
        moving = MovingObstacles(
            (MovingObstacle(complex(*xy), complex(*v), radius, 0.0, 0.0, 0.0) for xy, v, radius in states), 0.0
        )
        command = Twist(*rng.normal(0.0, (0.5, 0.1, 0.8)).tolist())
        with_quick_check.set_moving_obstacles(moving)
        without_quick_check.set_moving_obstacles(moving)
        allowed = without_quick_check.limit_command(command, Pose2(0.0, 0.0))
        assert with_quick_check.limit_command(command, Pose2(0.0, 0.0)) == allowed
        braked_count += allowed != command
        skipped_count += not with_quick_check._may_meet_moving(command, MonitorSpec().time_before_collision)
    assert braked_count > 10
    assert skipped_count > 100


@pytest.mark.parametrize(
    ("step", "free_time"),
    [(None, 0.375), (0.0625, 0.375), (0.1, 0.3), (0.005, 0.395), (0.5, 0.0), (9.0, 0.0)],
)
def test_simulation_time_step_is_the_resolution_of_the_time_before_collision(
    step: float | None, free_time: float
) -> None:
    """At 0.5 m/s, the robot has contact after 0.4 s. The time of the last step before contact limits its speed."""
    collision_monitor = monitor(**({} if step is None else {"simulation_time_step": step}))
    collision_monitor.on_scan(scan((0.22 + 0.02 + 0.199, 0.0)), Pose2(0, 0))
    allowed = collision_monitor.limit_command(Twist(0.5, 0.0, 0.0), Pose2(0, 0))
    assert allowed.vx == pytest.approx(0.5 * free_time / 0.5)
