"""Tests of the collision monitor with exact answers."""

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
    """A scan of one beam a point; the lidar is at the base."""
    angles = np.array([math.atan2(y, x) for x, y in points])
    step = 1e-3
    ranges = np.full(7000, np.inf)
    ranges[np.round((angles + 3.5) / step).astype(int)] = [math.hypot(x, y) for x, y in points]
    return Scan("lidar", tick, ranges, -3.5, step, 0.05, 12.0)


def monitor(robot: RobotModel | None = None, **options: float) -> CollisionMonitor:
    return CollisionMonitor(MonitorSpec(**options), robot or round_robot(), ("lidar",), TICK_RATE_HZ)


@pytest.mark.parametrize(("x", "scale"), [(2.0, 1.0), (0.22 + 0.02 + 0.125, 0.5), (0.23, 0.0)])
def test_monitor_limits_the_speed_by_the_time_before_collision(x: float, scale: float) -> None:
    guard = monitor()
    guard.on_scan(scan((x, 0.0)), Pose2(0, 0))
    allowed = guard.limit_command(Twist(0.5, 0.0, 0.0), Pose2(0, 0))
    assert allowed.vx == pytest.approx(0.5 * scale, abs=0.5 / 8)
    assert allowed.vx <= 0.5 * scale + 1e-9 or scale == 1.0


def test_monitor_allows_driving_away_from_a_near_obstacle() -> None:
    guard = monitor()
    guard.on_scan(scan((0.23, 0.0)), Pose2(0, 0))
    assert guard.limit_command(Twist(-0.2), Pose2(0, 0)) == Twist(-0.2)
    assert guard.limit_command(Twist(wz=1.0), Pose2(0, 0)) == Twist(wz=1.0)


def test_monitor_includes_the_motion_since_the_scan() -> None:
    guard = monitor()
    guard.on_scan(scan((0.6, 0.0)), Pose2(5, 5, 1.0))
    assert guard.limit_command(Twist(0.2), Pose2(5, 5, 1.0)) == Twist(0.2)
    moved = Pose2(5, 5, 1.0).compose(Pose2(0.36, 0.0))
    assert guard.limit_command(Twist(0.2), moved) == STOP


def test_monitor_checks_the_swinging_corners_of_a_long_hull() -> None:
    guard = monitor(box_robot())
    guard.on_scan(scan((0.15, 0.19)), Pose2(0, 0))
    assert guard.limit_command(Twist(wz=1.0), Pose2(0, 0)).wz < 0.5
    assert guard.limit_command(Twist(0.3), Pose2(0, 0)).vx == 0.3


def test_monitor_can_require_several_points() -> None:
    guard = monitor(min_points=3)
    guard.on_scan(scan((0.3, 0.0), (0.3, 0.01)), Pose2(0, 0))
    assert guard.limit_command(Twist(0.5), Pose2(0, 0)) == Twist(0.5)
    guard.on_scan(scan((0.3, 0.0), (0.3, 0.01), (0.3, -0.01)), Pose2(0, 0))
    assert guard.limit_command(Twist(0.5), Pose2(0, 0)).vx < 0.5


def test_source_times_out_without_scans_or_with_blind_scans() -> None:
    guard = monitor(source_timeout=0.3)
    guard.start(0)
    guard.on_scan(scan((2.0, 0.0)), Pose2(0, 0))
    assert not guard.is_silent(72)
    assert guard.is_silent(73)
    guard.on_scan(scan((2.0, 0.0), tick=100), Pose2(0, 0))
    assert not guard.is_silent(172)
    guard.on_scan(Scan("lidar", 180, np.full(9, np.nan), 0.0, 0.1, 0.05, 12.0), Pose2(0, 0))
    assert guard.is_silent(181)


def test_robot_waits_for_its_first_scan() -> None:
    guard = monitor(source_timeout=0.3)
    guard.start(12)
    assert guard.is_silent(12)
    assert guard.silence_reason(24) == "lidar `lidar` has been silent for 0.05 s; source_timeout is 0.3 s"
    guard.on_scan(scan((2.0, 0.0), tick=10), Pose2(0, 0), 30)
    assert not guard.is_silent(30)
    guard.start(60)
    assert not guard.is_silent(60)


def test_silent_lidar_has_a_reason() -> None:
    guard = monitor(source_timeout=0.3)
    guard.start(0)
    assert guard.silence_reason(240) == "lidar `lidar` has been silent for 1.00 s; source_timeout is 0.3 s"
    guard.on_scan(scan((2.0, 0.0), tick=120), Pose2(0, 0), 240)
    assert (
        guard.silence_reason(241) == "scans of lidar `lidar` are 0.50 s old when they arrive; source_timeout is 0.3 s"
    )
    guard.on_scan(Scan("lidar", 300, np.full(9, np.nan), 0.0, 0.1, 0.05, 12.0), Pose2(0, 0), 300)
    assert "blind for 0.75 s: its scans contain no returns" in guard.silence_reason(300)
    assert "silent" in guard.silence_reason(400)


@pytest.mark.parametrize("robot", [round_robot(), box_robot(1.0, 0.3)])
def test_quick_check_brakes_for_moving_obstacles_like_the_full_check(
    robot: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    hasty, thorough = (CollisionMonitor(MonitorSpec(), robot, (), TICK_RATE_HZ) for _ in range(2))
    monkeypatch.setattr(thorough, "_may_meet_moving", lambda *_: True)
    rng, braked, spared = np.random.default_rng(4), 0, 0
    for _ in range(400):
        places, speeds = rng.normal(0.0, 1.2, (2, 2)), rng.normal(0.0, 0.7, (2, 2))
        states = zip(places, speeds, (0.3, 0.1), strict=True)
        moving = MovingObstacles(
            (MovingObstacle(complex(*xy), complex(*v), radius, 0.0, 0.0, 0.0) for xy, v, radius in states), 0.0
        )
        wanted = Twist(*rng.normal(0.0, (0.5, 0.1, 0.8)).tolist())
        hasty.set_moving_obstacles(moving)
        thorough.set_moving_obstacles(moving)
        allowed = thorough.limit_command(wanted, Pose2(0.0, 0.0))
        assert hasty.limit_command(wanted, Pose2(0.0, 0.0)) == allowed
        braked += allowed != wanted
        spared += not hasty._may_meet_moving(wanted, MonitorSpec().time_before_collision)
    assert braked > 10
    assert spared > 100


@pytest.mark.parametrize(
    ("step", "free_time"),
    [(None, 0.375), (0.0625, 0.375), (0.1, 0.3), (0.005, 0.395), (0.5, 0.0), (9.0, 0.0)],
)
def test_simulation_time_step_is_the_resolution_of_the_time_before_collision(
    step: float | None, free_time: float
) -> None:
    """Contact after 0.4 s at 0.5 m/s: the last step before it counts."""
    guard = monitor(**({} if step is None else {"simulation_time_step": step}))
    guard.on_scan(scan((0.22 + 0.02 + 0.199, 0.0)), Pose2(0, 0))
    allowed = guard.limit_command(Twist(0.5, 0.0, 0.0), Pose2(0, 0))
    assert allowed.vx == pytest.approx(0.5 * free_time / 0.5)
