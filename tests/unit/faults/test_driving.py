"""Tests of faults of commands and wheels against the kinematics of a differential drive."""

import numpy as np
import pytest
from fault_effects import ManualClock, odometry, start, unsuitable_key

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry
from simscen.faults.base import AnyFault, FaultSetting
from simscen.model.robot import Differential, Omnidirectional

DIFFERENTIAL_DRIVE = Differential(type="differential", wheel_radius=0.1, wheel_separation=0.4)


def wheel_speeds(motion: Twist, separation: float = 0.4) -> tuple[float, float]:
    """Return the speed of the left and the right wheel on the ground in m/s."""
    return motion.vx - separation / 2 * motion.wz, motion.vx + separation / 2 * motion.wz


def test_gain_scales_commands():
    effect = start({"gain": {"linear": "50 %", "angular": -1}}, "Command")
    assert effect.command(Twist(0.4, 0.2, 1.0)) == pytest.approx((0.2, 0.1, -1.0))


def test_gain_of_one_side_does_not_affect_the_other():
    effect = start({"gain": {"left": "80 %"}}, "Wheels", separation=0.4)
    motion = Twist(0.4, 0.0, 0.5)
    left, right = wheel_speeds(effect.command(motion))
    assert (left, right) == pytest.approx((0.8 * wheel_speeds(motion)[0], wheel_speeds(motion)[1]))


def test_saturation_limits_speed_and_keeps_direction():
    effect = start({"saturation": {"linear": 0.5, "angular": 1.0}}, "Command")
    assert effect.command(Twist(0.6, 0.8, -3.0)) == pytest.approx((0.3, 0.4, -1.0))
    assert effect.command(Twist(0.1, 0.0, 0.5)) == pytest.approx((0.1, 0.0, 0.5))


def test_saturated_side_is_limited_forward_and_backward():
    effect = start({"saturation": {"left": 0.2}}, "Wheels", separation=0.4)
    for motion, expected in (((0.4, 0, 0.5), (0.2, 0.5)), ((-0.4, 0, 0), (-0.2, -0.4)), ((0.1, 0, 0), (0.1, 0.1))):
        assert wheel_speeds(effect.command(Twist(*motion))) == pytest.approx(expected)


def test_acceleration_is_limited_between_beats():
    now = ManualClock()
    effect = start({"saturation": {"linear_acceleration": 0.5, "angular_acceleration": 1.0}}, "Wheels", now)
    effect.command(Twist())
    speeds = []
    for now.tick in range(12, 361, 12):
        speeds.append(effect.command(Twist(0.6, 0.0, 2.0)))
    assert [speed.vx for speed in speeds] == pytest.approx(np.minimum(0.6, 0.025 * np.arange(1, 31)))
    assert [speed.wz for speed in speeds] == pytest.approx(np.minimum(2.0, 0.05 * np.arange(1, 31)))


def test_acceleration_is_limited_from_the_command_before_the_fault():
    now, fault = ManualClock(), AnyFault.model_validate({"saturation": {"linear_acceleration": 0.5}}).fault
    effect = fault.begin(np.random.default_rng(1), FaultSetting(now=now, kind="Wheels", command=Twist(0.2)))
    assert effect.command(Twist(0.6)) == Twist(0.2)
    now.tick = 24
    assert effect.command(Twist(0.6)).vx == pytest.approx(0.25)


def test_wheel_slip_affects_each_odometry_sensor_separately():
    effect = start({"slip": {"left": 0.5, "right": 0.5}}, "Wheels")
    assert effect.command(Twist(0.4)) == pytest.approx((0.2, 0, 0))
    for k in range(5):
        first = effect.reading(odometry(Pose2(0.1 * k, 0), 6 * k))
        other = effect.reading(Odometry("other", 6 * k, Pose2(5 + 0.1 * k, 0), Twist()))
    assert first.pose.x == pytest.approx(0.8)
    assert other.pose.x == pytest.approx(5.8)


@pytest.mark.parametrize("word", ["gain", "saturation"])
def test_left_and_right_are_valid_only_for_differential_wheels(word):
    assert unsuitable_key({word: {"left": 0.5}}, "Command")[0] == "left"
    assert unsuitable_key({word: {"right": 0.5}}, "Wheels", spec=Omnidirectional(type="omnidirectional"))[0] == "right"
    assert unsuitable_key({word: {"right": 0.5}}, "Wheels", spec=DIFFERENTIAL_DRIVE) is None


def test_battery_limit_falls_linearly_and_keeps_the_curvature_of_commands():
    now = ManualClock()
    effect = start({"low_battery": {"start": 0.5, "end": 0.1, "drain": "10 s"}}, "Command", now)
    motion, limits = Twist(0.6, 0.0, 0.3), {0: 0.5, 1200: 0.3, 2400: 0.1, 4800: 0.1}
    for now.tick, limit in limits.items():
        assert effect.command(motion) == pytest.approx((limit, 0.0, limit / 2))
    assert effect.command(Twist(0.05, 0.0, 1.0)) == Twist(0.05, 0.0, 1.0)


def test_rising_battery_curve_is_refused():
    with pytest.raises(ValueError, match="a battery does not charge itself"):
        start({"low_battery": {"start": 0.1, "end": 0.5}}, "Command")
