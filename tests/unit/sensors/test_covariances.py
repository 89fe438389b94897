"""Tests of the covariances in odometry and IMU messages: closed forms, and the scatter of many seeded readings."""

import numpy as np
import pytest
from puppet import Puppet
from test_imu import imu
from test_odometry import odometry, roll

from simscen.model.robot import Omnidirectional

NOISE = {"translation_noise": 0.02, "rotation_noise": 0.03, "drift_noise": 0.04}
SECONDS = 0.025
RUNS = 400


def test_the_variance_of_the_twist_has_a_closed_form() -> None:
    """d = 0.5 m/s * t and |turn| = 0.8 rad/s * t; the variances are divided by t²."""
    view = Puppet()
    sensor = odometry(view, **NOISE)
    roll(view, 0.5, -0.8, SECONDS)
    vx, vy, wz = sensor.read(6).twist_variance
    assert vx == pytest.approx(0.02**2 * 0.5 / SECONDS)
    assert vy == 0.0
    assert wz == pytest.approx((0.03**2 * 0.8 + 0.04**2 * 0.5) / SECONDS)


def test_a_base_that_moves_sideways_has_a_lateral_variance() -> None:
    view = Puppet(wheel_angles=(0.0, 0.0, 0.0))
    sensor = odometry(view, Omnidirectional(type="omnidirectional"), **NOISE)
    view.wheel_angles = (0.03, 0.04, 0.0)
    vx, vy, _ = sensor.read(6).twist_variance
    assert vx == vy == pytest.approx(0.02**2 * 0.05 / SECONDS**2)


def test_wheels_at_rest_have_no_variance() -> None:
    assert odometry(Puppet(wheel_angles=(1.0, 2.0)), **NOISE).read(6).twist_variance == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("rate", [10, 40])
@pytest.mark.parametrize(("vx", "wz"), [(0.5, 0.0), (0.0, 1.0), (0.3, -0.9)])
def test_scatter_of_twists_matches_their_variance(vx: float, wz: float, rate: int) -> None:
    twists, variances = [], []
    for seed in range(3000, 3000 + RUNS):
        view = Puppet()
        sensor = odometry(view, seed=seed, seconds=1 / rate, **NOISE)
        roll(view, vx, wz, 1 / rate)
        reading = sensor.read(6)
        twists.append(reading.twist)
        variances.append(reading.twist_variance)
    # The standard deviation of a variance from n samples is sqrt(2 / n): 7 % here.
    assert np.var(twists, axis=0) == pytest.approx(np.mean(variances, axis=0), rel=0.25, abs=1e-15)


def test_scatter_of_poses_matches_their_covariance() -> None:
    """After an arc of 2 m and 1.6 rad, the mean NEES of the pose is within its 99.9 % bounds around 3."""
    ends, covariances = [], []
    for seed in range(4000, 4000 + RUNS):
        view = Puppet()
        sensor = odometry(view, seed=seed, **NOISE)
        for k in range(160):
            roll(view, 0.5, 0.4, SECONDS)
            reading = sensor.read(6 * k)
        ends.append(reading.pose)
        covariances.append(np.reshape(reading.pose_covariance, (3, 3)))
    view = Puppet()
    exact = odometry(view, translation_noise=0.0, rotation_noise=0.0, drift_noise=0.0)
    for k in range(160):
        roll(view, 0.5, 0.4, SECONDS)
        truth = exact.read(6 * k).pose
    errors = np.array(ends) - truth
    nees = [error @ np.linalg.solve(covariance, error) for error, covariance in zip(errors, covariances, strict=True)]
    assert np.allclose(covariances, np.transpose(covariances, (0, 2, 1)))
    assert np.mean(nees) == pytest.approx(3.0, abs=3.3 * np.sqrt(6 / RUNS))
    assert np.cov(errors.T) == pytest.approx(np.mean(covariances, axis=0), rel=0.35, abs=2e-5)


def test_the_variances_of_an_imu_are_those_of_its_white_noise() -> None:
    sensor = imu(Puppet(), gyro_noise=0.01, gyro_bias=0.5, accelerometer_noise=0.1)
    readings = [sensor.read(k) for k in range(3000)]
    rates, forces = ([getattr(r, name) for r in readings] for name in ("angular_velocity", "linear_acceleration"))
    assert np.var(rates, axis=0) == pytest.approx([readings[0].angular_velocity_variance] * 3, rel=0.12)
    assert np.var(forces, axis=0) == pytest.approx([readings[0].linear_acceleration_variance] * 3, rel=0.12)
