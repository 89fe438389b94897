"""Tests of scan and odometry faults against their definitions."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.faults.base import AnyFault, FaultSetting


def start(fault: dict, separation=0.3, seed=1):
    """Return the effect of a fault that is written as in a scenario."""
    kind = "Scan" if "noise" in fault else "Odometry"
    return AnyFault.model_validate(fault).fault.begin(np.random.default_rng(seed), FaultSetting(separation, kind=kind))


def scan(ranges) -> Scan:
    return Scan("lidar", 0, np.asarray(ranges, dtype=float), -math.pi, 0.01, 0.1, 12.0)


def straight_drive(meters: float, steps: int = 100):
    """Return the odometry readings of a robot that drives straight ahead."""
    return [Odometry("odom", k, Pose2(meters * k / steps, 0, 0), Twist(0.5, 0, 0)) for k in range(steps + 1)]


def test_sensor_that_is_off_publishes_nothing():
    assert start({"off": {}}).reading(scan([1.0])) is None


def test_dropout_loses_the_given_share_of_messages():
    fault = start({"dropout": {"probability": "30 %"}})
    lost = sum(fault.reading(scan([1.0])) is None for _ in range(4000))
    assert lost / 4000 == pytest.approx(0.3, abs=0.03)


def test_beam_dropout_loses_the_given_share_of_beams():
    output = start({"beam_dropout": {"probability": 0.4}}).reading(scan(np.full(4000, 2.0)))
    assert np.isnan(output.ranges).mean() == pytest.approx(0.4, abs=0.035)
    assert set(output.ranges[~np.isnan(output.ranges)]) == {2.0}


def test_noise_has_the_given_standard_deviation_and_no_bias():
    output = start({"noise": {"std": "10 cm"}}).reading(scan(np.full(10_000, 5.0))).ranges
    assert output.std() == pytest.approx(0.1, rel=0.04)
    assert output.mean() == pytest.approx(5.0, abs=0.005)


def test_noise_keeps_beams_without_a_hit_and_the_range_of_the_sensor():
    output = start({"noise": {"std": 1.0}}).reading(scan([np.inf, np.nan, 0.1, 12.0] * 50)).ranges
    assert np.isinf(output[0::4]).all()
    assert np.isnan(output[1::4]).all()
    finite = output[np.isfinite(output)]
    assert finite.min() >= 0.1
    assert finite.max() <= 12.0


def test_fault_does_not_modify_its_input():
    original = scan(np.full(100, 2.0))
    start({"noise": {"std": 1.0}}).reading(original)
    start({"beam_dropout": {"probability": 1.0}}).reading(original)
    assert (original.ranges == 2.0).all()


def test_linear_bias_scales_the_reported_distance():
    fault = start({"bias": {"linear_scale": 1.1}})
    reported = [fault.reading(odometry) for odometry in straight_drive(2.0)]
    assert reported[-1].pose.x == pytest.approx(2.2)
    assert reported[-1].twist.vx == pytest.approx(0.55)


def test_turn_per_meter_bends_the_reported_path_into_an_arc():
    fault = start({"bias": {"turn_per_metre": 0.5}})
    end = [fault.reading(odometry) for odometry in straight_drive(2.0, 2000)][-1].pose
    assert end.yaw == pytest.approx(1.0)
    assert (end.x, end.y) == pytest.approx((math.sin(1.0) / 0.5, (1 - math.cos(1.0)) / 0.5), abs=2e-3)


def test_slip_reduces_the_true_distance():
    fault = start({"slip": {"left": 0.25, "right": 0.25}})
    assert fault.command(Twist(0.4, 0, 0.8)) == pytest.approx((0.3, 0, 0.6))
    assert [fault.reading(odometry) for odometry in straight_drive(3.0)][-1].pose.x == pytest.approx(4.0)


def test_slip_on_one_side_turns_the_robot_but_not_its_odometry():
    fault = start({"slip": {"left": 0.5}}, separation=0.4)
    true_twist = fault.command(Twist(1.0, 0, 0))
    # left wheel at half speed: v = (0.5 + 1) / 2, w = (1 - 0.5) / 0.4
    assert true_twist == pytest.approx((0.75, 0, 1.25))
    reported = fault.reading(Odometry("odom", 0, Pose2(0, 0, 0), true_twist)).twist
    assert reported == pytest.approx((1.0, 0, 0))


def test_error_of_an_odometry_fault_remains_after_its_end_without_growing():
    fault = start({"bias": {"linear_scale": 2.0}})
    readings = straight_drive(2.0)
    for odometry in readings[:51]:
        reported = fault.reading(odometry)
    assert reported.pose.x == pytest.approx(2.0)
    remaining = fault.end()
    assert remaining is not None
    for odometry in readings[51:]:
        reported = remaining.reading(odometry)
    assert reported.pose.x == pytest.approx(3.0)
    assert reported.twist.vx == pytest.approx(0.5)
