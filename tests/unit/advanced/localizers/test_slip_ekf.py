"""Tests of the slip EKF: dead reckoning, sensor fusion, and covariance."""

import numpy as np
import pytest
from scipy import stats

from simscen.advanced.spec import SlipEkf
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Imu, Odometry
from simscen.stack.protocols import Localizer
from simscen.testing.synthetic_room import Noise, build_localizer, drive, nees, pose_errors, run_localizer

STD = np.array([0.1, 0.1, 0.05])
"""Standard deviations of the initial pose: m, m, rad."""
SPEC = SlipEkf(type="slip_ekf", translation_noise=0.01, rotation_noise=0.01, gyro_noise=0.002)
AS_SPECIFIED = Noise(drift=0.01, gyro_bias=0.002)
NO_NOISE = Noise(translation=0, rotation=0, drift=0, gyro=0, gyro_bias=0)


def ekf(estimate: Estimate) -> Localizer:
    return build_localizer(SPEC, estimate, 1)


def feed(localizer: Localizer, steps: int, step: Pose2, rate: float | None) -> None:
    """Feed odometry steps of 1/40 s and gyroscope readings of `rate` in rad/s."""
    pose = Pose2(0, 0, 0)
    for k in range(steps + 1):
        if rate is not None:
            localizer.on_imu(Imu("imu", 6 * k, (0.0, 0.0, rate), (0.0, 0.0, 9.81)))
        localizer.on_odometry(Odometry("odom", 6 * k, pose, Twist()))
        pose = pose.compose(step)


@pytest.mark.parametrize("imu", [False, True])
def test_pose_without_noise_equals_the_truth(imu: bool) -> None:
    log = drive(30.0)
    localizer = ekf(Estimate(Pose2(*log.truth[0]), (0.0, 0.0, 0.0)))
    assert np.abs(pose_errors(run_localizer(localizer, log, 1, NO_NOISE, imu=imu), log.truth)).max() < 1e-6


@pytest.mark.sample(1)
@pytest.mark.parametrize("imu", [False, True])
def test_covariance_is_consistent_with_the_errors(imu: bool, is_quick: bool) -> None:
    """The sum of NEES values has a chi-square distribution; a consistent filter fails 1 of 1000 such tests."""
    log, values, runs = drive(10.0), [], 15 if is_quick else 50
    for seed in range(runs):
        start = Pose2(*(log.truth[0] + np.random.default_rng((seed, 3)).normal(0, STD)))
        localizer = ekf(Estimate(start, (STD[0], STD[1], STD[2])))
        beliefs = run_localizer(localizer, log, seed, AS_SPECIFIED, imu=imu)
        values.append(nees(beliefs[-1], pose_errors(beliefs, log.truth)[-1]))
    low, high = stats.chi2.ppf([0.0005, 0.9995], 3 * runs)
    assert low <= np.sum(values) <= high


def test_gyroscope_without_rotation_outweighs_slipping_wheels() -> None:
    """The wheels measure 1 rad/s and the gyroscope 0 rad/s, which is far more precise."""
    localizer = ekf(Estimate(Pose2(0, 0, 0), (0.0, 0.0, 0.0)))
    feed(localizer, 40, Pose2(0.0125, 0, 0.025), 0.0)
    wheels_only = ekf(Estimate(Pose2(0, 0, 0), (0.0, 0.0, 0.0)))
    feed(wheels_only, 40, Pose2(0.0125, 0, 0.025), None)
    assert wheels_only.belief.pose.yaw == pytest.approx(1.0)
    assert abs(localizer.belief.pose.yaw) < 0.1
    assert localizer.belief.covariance[2, 2] < wheels_only.belief.covariance[2, 2]


def test_gyroscope_bias_is_estimated_at_standstill() -> None:
    """Without the estimate of the bias, the heading would be wrong by 0.04 rad."""
    localizer = ekf(Estimate(Pose2(0, 0, 0), (0.0, 0.0, 0.0)))
    feed(localizer, 400, Pose2(0, 0, 0), 0.004)
    assert abs(localizer.belief.pose.yaw) < 2e-4
    assert abs(localizer.belief.pose.yaw) < 3 * localizer.belief.covariance[2, 2] ** 0.5


def test_corrected_turn_also_corrects_the_path() -> None:
    """Odometry reports arcs at 1 rad/s, the gyroscope reports 0 rad/s: the chords form a straight line."""
    localizer = build_localizer(
        SlipEkf(type="slip_ekf", rotation_noise=50.0, gyro_noise=1e-5), Estimate(Pose2(0, 0, 0), (0, 0, 0)), 1
    )
    arc = Pose2(0.0125 * np.cos(0.0125), 0.0125 * np.sin(0.0125), 0.025)
    feed(localizer, 40, arc, 0.0)
    assert localizer.belief.pose == pytest.approx((0.5, 0, 0), abs=2e-3)


@pytest.mark.parametrize("rate", [np.nan, np.inf, 1e9])
def test_broken_gyroscope_is_ignored(rate: float) -> None:
    localizer = ekf(Estimate(Pose2(0, 0, 0), (0.1, 0.1, 0.1)))
    feed(localizer, 40, Pose2(0.01, 0, 0), rate)
    assert localizer.belief.pose == pytest.approx((0.4, 0, 0))


def test_covariance_of_a_straight_path_equals_the_closed_form() -> None:
    """The heading variance grows with the distance L, and the lateral variance is its integral, rn² L³ / 3."""
    localizer = ekf(Estimate(Pose2(0, 0, 0), (0.0, 0.0, 0.0)))
    feed(localizer, 400, Pose2(0.025, 0, 0), None)
    covariance: Array = localizer.belief.covariance
    length, noise = 10.0, 0.01
    assert covariance[0, 0] == pytest.approx(noise**2 * length, rel=0.01)
    assert covariance[1, 1] == pytest.approx(noise**2 * length**3 / 3, rel=0.01)
    assert covariance[2, 2] == pytest.approx(noise**2 * length, rel=0.01)
