"""Tests of the IMU: gravity, acceleration, angular velocity, noise, and teleporting."""

import math

import numpy as np
import pytest
from puppet import Puppet

from simscen.core.geometry import Pose3
from simscen.model.sensors import InertialUnit
from simscen.sensors.imu import ImuSensor
from simscen.sensors.sensor import SensorSetting

EXACT = {"gyro_noise": 0.0, "gyro_bias": 0.0, "accelerometer_noise": 0.0}


def imu(view, seed=1, **spec):
    setting = SensorSetting("imu", 4, 1 / 60, np.random.default_rng(seed), view, None, None)
    return ImuSensor(InertialUnit(**spec), setting)


def test_level_imu_at_rest_measures_gravity():
    reading = imu(Puppet(), **EXACT).read(4)
    assert reading.linear_acceleration == (0.0, 0.0, 9.81)
    assert reading.angular_velocity == (0.0, 0.0, 0.0)


def test_imu_measures_acceleration_in_its_own_frame():
    view = Puppet(Pose3.from_rpy(0, 0, 0, 0, 0, math.pi / 2))
    sensor = imu(view, **EXACT)
    view.linear = (0.0, 0.02, 0.0)  # along y of the world, which is forward for this robot
    assert sensor.read(4).linear_acceleration == pytest.approx((1.2, 0.0, 9.81))
    assert sensor.read(8).linear_acceleration == pytest.approx((0.0, 0.0, 9.81))


def test_imu_on_a_slope_measures_tilted_gravity():
    reading = imu(Puppet(Pose3.from_rpy(0, 0, 0, 0, -0.1, 0)), **EXACT).read(4)
    assert reading.linear_acceleration == pytest.approx((9.81 * math.sin(0.1), 0.0, 9.81 * math.cos(0.1)))


def test_imu_measures_angular_velocity_about_its_own_axes():
    view = Puppet(Pose3.from_rpy(0, 0, 0, math.pi / 2, 0, 0), angular=(0.0, 0.0, 1.0))
    assert imu(view, **EXACT).read(4).angular_velocity == pytest.approx((0.0, 1.0, 0.0))


def test_noise_changes_between_readings_and_bias_does_not():
    spec = {"gyro_noise": 0.01, "gyro_bias": 0.5, "accelerometer_noise": 0.1}
    sensor = imu(Puppet(), **spec)
    readings = [sensor.read(k) for k in range(3000)]
    rates = np.array([reading.angular_velocity for reading in readings])
    forces = np.array([reading.linear_acceleration for reading in readings]) - (0, 0, 9.81)
    assert rates.std(axis=0) == pytest.approx([0.01] * 3, rel=0.06)
    assert forces.std(axis=0) == pytest.approx([0.1] * 3, rel=0.06)
    assert np.abs(rates.mean(axis=0)).max() > 0.05
    biases = [imu(Puppet(), seed, gyro_noise=0.0, gyro_bias=0.5).read(0).angular_velocity[2] for seed in range(400)]
    assert np.std(biases) == pytest.approx(0.5, rel=0.12)


@pytest.mark.parametrize("pose", [Pose3.from_rpy(3, 1, 0, 0, 0, 2), Pose3.from_rpy(0.01, 0, 0, 0, 0, 2), Pose3()])
def test_teleporting_causes_no_acceleration(pose):
    view = Puppet(linear=(0.4, 0.0, 0.0))
    sensor = imu(view, **EXACT)
    view.pose, view.linear, view.placement_count = pose, (0.0, 0.0, 0.0), 1
    assert sensor.read(4).linear_acceleration == pytest.approx((0.0, 0.0, 9.81))
    view.linear = (0.02, 0.0, 0.0)
    assert math.hypot(*sensor.read(8).linear_acceleration[:2]) == pytest.approx(1.2)
