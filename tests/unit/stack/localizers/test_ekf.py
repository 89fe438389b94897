"""Tests of the EKF: exact dead reckoning, fusion with the gyroscope, and consistency of its covariance."""

import numpy as np
import pytest
from scipy import stats

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Imu, Odometry
from simscen.model.localizers import Ekf
from simscen.stack.protocols import Localizer
from simscen.testing.synthetic_room import Noise, build_localizer, drive, nees, pose_errors, run_localizer

SPEC = Ekf(type="ekf", translation_noise=0.01, rotation_noise=0.01, gyro_noise=0.002)
AS_SPECIFIED = Noise(drift=0.01, gyro_bias=0.002)
NOISELESS = Noise(translation=0, rotation=0, drift=0, gyro=0, gyro_bias=0)
STD = np.array([0.1, 0.1, 0.05])
"""Standard deviations of the initial pose: m, m, rad."""


def ekf(spec: Ekf, estimate: Estimate) -> Localizer:
    return build_localizer(spec, estimate, 1)


def odometry(tick: int, pose: Pose2) -> Odometry:
    return Odometry("odom", tick, pose, Twist())


@pytest.mark.parametrize("imu", [False, True])
def test_pose_without_noise_is_exact(imu: bool) -> None:
    log = drive(30.0)
    localizer = ekf(SPEC, Estimate(Pose2(*log.truth[0]), (0.0, 0.0, 0.0)))
    assert np.abs(pose_errors(run_localizer(localizer, log, 1, NOISELESS, imu=imu), log.truth)).max() < 1e-4


def test_a_precise_gyroscope_corrects_the_heading_of_the_wheels() -> None:
    localizer = ekf(Ekf(type="ekf", rotation_noise=0.5, gyro_noise=1e-4, gyro_bias=0.0), Estimate(Pose2(0, 0, 0)))
    localizer.on_odometry(odometry(0, Pose2(0, 0, 0)))
    localizer.on_imu(Imu("imu", 6, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81)))
    localizer.on_odometry(odometry(6, Pose2(0.1, 0.0, 0.3)))
    assert abs(localizer.belief.pose.yaw) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("imu", [False, True])
def test_the_covariance_agrees_with_the_error(imu: bool) -> None:
    """The average NEES lies within the 99.9 % bounds of a consistent filter with three degrees of freedom."""
    log, values = drive(10.0), []
    for seed in range(700, 750):
        start = Pose2(*(log.truth[0] + np.random.default_rng((seed, 3)).normal(0, STD)))
        beliefs = run_localizer(ekf(SPEC, Estimate(start, (STD[0], STD[1], STD[2]))), log, seed, AS_SPECIFIED, imu=imu)
        values.append(nees(beliefs[-1], pose_errors(beliefs, log.truth)[-1]))
    low, high = stats.chi2.ppf([0.0005, 0.9995], 3 * len(values))
    assert low < np.sum(values) < high


def test_gyroscope_bias_is_estimated_at_standstill() -> None:
    localizer = ekf(SPEC, Estimate(Pose2(0, 0, 0), (0.0, 0.0, 0.0)))
    for k in range(400):
        localizer.on_imu(Imu("imu", 6 * k, (0.0, 0.0, 0.004), (0.0, 0.0, 9.81)))
        localizer.on_odometry(odometry(6 * k, Pose2(0, 0, 0)))
    assert abs(localizer.belief.pose.yaw) < 1e-3


def test_covariance_at_standstill_is_not_singular() -> None:
    localizer = ekf(SPEC, Estimate(Pose2(0, 0, 0), (0.1, 0.1, 0.1)))
    for k in range(100):
        localizer.on_odometry(odometry(6 * k, Pose2(0, 0, 0)))
    assert np.linalg.eigvalsh(localizer.belief.covariance).min() > 0
