"""Tests of the tilt of the robot, estimated from IMU and odometry, and of the removal of lidar hits on the floor."""

import math

import numpy as np
import pytest

from simscen.advanced.tilt import TiltEstimator
from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Imu, Odometry, Scan

TICK_RATE_HZ, PERIOD = 240, 6
STEP_S = PERIOD / TICK_RATE_HZ


def feed_drive(
    tilt: TiltEstimator, seconds: float, slope: float, twist_at, pitch_rate=lambda _: 0.0, pitch=None
) -> None:
    """Pass the exact readings of a robot that is pitched down by `slope` rad, or by `pitch(t)` if given."""
    start = 0 if tilt._imu is None else tilt._imu.tick + PERIOD
    for step in range(round(seconds / STEP_S)):
        t = step * STEP_S
        pitch_down = slope if pitch is None else pitch(t)
        twist, next_twist = twist_at(t), twist_at(t + STEP_S)
        ax, ay = (next_twist.vx - twist.vx) / STEP_S, (next_twist.vy - twist.vy) / STEP_S + twist.vx * twist.wz
        gravity = -GRAVITY_M_S2 * math.sin(pitch_down), GRAVITY_M_S2 * math.cos(pitch_down)
        tilt.add_odometry(Odometry("odom", start + step * PERIOD, Pose2(0.0, 0.0), next_twist))
        acceleration = (gravity[0] + ax, ay, gravity[1])
        tilt.add_imu(Imu("imu", start + step * PERIOD, (0.0, pitch_rate(t), twist.wz), acceleration))


@pytest.mark.parametrize("slope", [-0.14, 0.0, 0.1])
def test_estimated_tilt_equals_the_slope(slope: float) -> None:
    tilt = TiltEstimator(TICK_RATE_HZ)
    feed_drive(tilt, 8.0, slope, lambda _: Twist(0.4))
    assert tilt.up == pytest.approx((-math.sin(slope), 0.0, math.cos(slope)), abs=1e-3)


def test_gyroscope_detects_the_start_of_a_slope_within_half_a_second() -> None:
    tilt = TiltEstimator(TICK_RATE_HZ)
    feed_drive(tilt, 1.0, 0.0, lambda _: Twist(0.4))
    feed_drive(tilt, 0.5, 0.0, lambda _: Twist(0.4), pitch_rate=lambda _: 0.2, pitch=lambda t: 0.2 * t)
    assert tilt.up[0] == pytest.approx(-math.sin(0.1), abs=0.01)


@pytest.mark.parametrize(
    "twist_at",
    [
        lambda t: Twist(1.5 * t),
        lambda t: Twist(3.0 - 1.5 * t),
        lambda t: Twist(0.0, 1.5 * t),
        lambda _: Twist(1.5, 0.0, 1.0),
    ],
    ids=["acceleration", "braking", "lateral acceleration", "turn"],
)
def test_acceleration_of_the_robot_is_not_mistaken_for_tilt(twist_at) -> None:
    tilt = TiltEstimator(TICK_RATE_HZ)
    feed_drive(tilt, 2.0, 0.0, twist_at)
    assert math.hypot(*tilt.up[:2]) < 0.03


def test_long_gaps_and_invalid_readings_do_not_change_the_tilt() -> None:
    tilt = TiltEstimator(TICK_RATE_HZ)
    tilt.add_imu(Imu("imu", 0, (0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY_M_S2)))
    tilt.add_imu(Imu("imu", 10 * TICK_RATE_HZ, (0.0, 5.0, 0.0), (GRAVITY_M_S2, 0.0, 0.0)))
    tilt.add_imu(Imu("imu", 10 * TICK_RATE_HZ + 6, (0.0, math.nan, 0.0), (0.0, 0.0, GRAVITY_M_S2)))
    assert tilt.up == (0.0, 0.0, 1.0)


def scan(ranges: list[float], yaw: float = 0.0) -> Scan:
    """Return a scan with beams ahead, to the left, behind, and to the right, in the frame of a lidar turned by yaw."""
    return Scan("lidar", 0, np.array(ranges), 0.0, math.pi / 2, 0.1, 12.0, Pose2(0.1, 0.0, yaw))


def test_possible_hits_on_the_floor_are_invalid() -> None:
    """A lidar 18 cm above the floor sees it at 0.18 m / sin(0.1) = 1.8 m."""
    tilt = TiltEstimator(TICK_RATE_HZ)
    feed_drive(tilt, 8.0, 0.1, lambda _: Twist(0.4))
    assert np.array_equal(tilt.without_floor(scan([1.8, 2.0, 2.0, 2.0])).ranges, [np.nan, 2, 2, 2], equal_nan=True)
    assert np.array_equal(tilt.without_floor(scan([np.inf, 2.0, 2.0, 2.0])).ranges, [np.inf, 2, 2, 2])
    turned = tilt.without_floor(scan([2.0, 1.8, 2.0, 2.0], yaw=-math.pi / 2))
    assert np.array_equal(turned.ranges, [2, np.nan, 2, 2], equal_nan=True)


def test_near_obstacles_and_scans_of_a_level_robot_are_unchanged() -> None:
    tilt = TiltEstimator(TICK_RATE_HZ)
    level = scan([2.0, 2.0, 2.0, 2.0])
    assert tilt.without_floor(level) is level
    feed_drive(tilt, 8.0, 0.1, lambda _: Twist(0.4))
    near = scan([0.9, 2.0, 2.0, 2.0])
    assert tilt.without_floor(near) is near
