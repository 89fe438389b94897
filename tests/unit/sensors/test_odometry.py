"""Tests of wheel odometry against the kinematics of each drive and the moments of its noise."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from puppet import Puppet

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import Ackermann, Differential, Omnidirectional, SkidSteer
from simscen.model.sensors import WheelOdometry
from simscen.sensors.odometry import WheelOdometrySensor, integrate_arc
from simscen.sensors.sensor import SensorSetting

DRIVE = Differential(type="differential", wheel_radius=0.033, wheel_separation=0.287)
EXACT = {"translation_noise": 0.0, "rotation_noise": 0.0, "drift_noise": 0.0}


def odometry(view, drive=DRIVE, seed=1, seconds=0.025, **spec):
    rng = np.random.default_rng(seed)
    setting = SensorSetting("odom", 6, seconds, rng, view, None, drive)
    return WheelOdometrySensor(WheelOdometry(**spec), setting)


def roll(view, vx, wz, seconds, drive=DRIVE):
    """Turn the wheels as in motion without slip at `vx` m/s and `wz` rad/s."""
    half = drive.wheel_separation / 2
    left, right = view.wheel_angles
    left, right = (
        left + (vx - wz * half) * seconds / drive.wheel_radius,
        right + (vx + wz * half) * seconds / drive.wheel_radius,
    )
    view.wheel_angles = (left, right)


@pytest.mark.parametrize("drive", [
    DRIVE,
    SkidSteer(type="skid_steer", wheel_radius=0.098, wheel_separation=0.376, wheel_base=0.26),
    Ackermann(type="ackermann", wheel_radius=0.08, wheel_separation=0.3, wheel_base=0.4, max_steering=0.5),
])  # fmt: skip
def test_odometry_without_noise_and_slip_is_exact(drive):
    """An eighth of a circle in one increment: the arc, not its chord."""
    view = Puppet()
    sensor = odometry(view, drive, **EXACT)
    roll(view, 0.5, 0.5, math.pi / 2, drive)
    reading = sensor.read(6)
    assert reading.pose == pytest.approx(Pose2(math.sin(math.pi / 4), 1 - math.cos(math.pi / 4), math.pi / 4))


def test_the_twist_is_the_mean_velocity_since_the_last_reading():
    view = Puppet()
    sensor = odometry(view, **EXACT)
    roll(view, 0.4, -0.3, 0.025)
    assert sensor.read(6).twist == pytest.approx(Twist(0.4, 0.0, -0.3))


def test_skid_steer_odometry_uses_the_turning_scale():
    drive = SkidSteer(type="skid_steer", wheel_radius=0.1, wheel_separation=0.4, wheel_base=0.3, turning_scale=1.5)
    view = Puppet()
    sensor = odometry(view, drive, **EXACT)
    roll(view, 0.0, 1.0, 0.3, drive)
    assert sensor.read(6).pose.yaw == pytest.approx(0.2)


def test_omnidirectional_odometry_includes_sideways_motion():
    view = Puppet(wheel_angles=(0.0, 0.0, 0.0))
    sensor = odometry(view, Omnidirectional(type="omnidirectional"), **EXACT)
    view.wheel_angles = (0.0, 0.5 * math.pi, math.pi)
    assert sensor.read(6).pose == pytest.approx(Pose2(-1.0, 0.0, math.pi))


def test_odom_frame_starts_at_the_initial_pose():
    sensor = odometry(Puppet(wheel_angles=(123.0, 45.0)), **EXACT)
    assert sensor.read(0).pose == Pose2(0.0, 0.0, 0.0)


def test_a_robot_at_rest_does_not_drift():
    sensor = odometry(Puppet(wheel_angles=(1.0, 2.0)))
    assert {sensor.read(k).pose for k in range(100)} == {Pose2(0.0, 0.0, 0.0)}


@pytest.mark.parametrize("rate", [10, 40])
def test_errors_after_a_meter_have_the_specified_deviation_at_any_rate(rate):
    spec = {"translation_noise": 0.02, "rotation_noise": 0.0, "drift_noise": 0.03}
    ends = []
    for seed in range(400):
        view = Puppet()
        sensor = odometry(view, seed=seed, seconds=1 / rate, **spec)
        for k in range(2 * rate):
            roll(view, 0.5, 0.0, 1 / rate)
            reading = sensor.read(k)
        ends.append((reading.pose.x, reading.pose.yaw))
    x, yaw = np.array(ends).T
    # The standard deviation of a standard deviation from n samples is 1 / sqrt(2 n): 3.5 % here.
    assert x.mean() == pytest.approx(1.0, abs=0.005)
    assert x.std() == pytest.approx(0.02, rel=0.12)
    assert yaw.std() == pytest.approx(0.03, rel=0.12)


def test_errors_after_a_radian_have_the_specified_deviation():
    yaws = []
    for seed in range(400):
        view = Puppet()
        sensor = odometry(view, seed=seed, translation_noise=0.0, rotation_noise=0.05, drift_noise=0.0)
        for k in range(40):
            roll(view, 0.0, 1.0, 0.025)
            reading = sensor.read(k)
        yaws.append(reading.pose.yaw)
    assert np.std(yaws) == pytest.approx(0.05, rel=0.12)


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3))
def test_arc_in_two_steps_equals_arc_in_one_step(vx, vy, wz):
    half = integrate_arc(Twist(vx / 2, vy / 2, wz / 2))
    assert half.compose(half) == pytest.approx(integrate_arc(Twist(vx, vy, wz)), abs=1e-8)
