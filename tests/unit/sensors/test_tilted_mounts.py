"""Tests of lidars and IMUs with roll and pitch on level and tilted robots, in the sensor and the base frame."""

import math
from dataclasses import replace

import numpy as np
import pytest
from puppet import EmptyWorld, Puppet, SquareRoom, puppet_at

from simscen.core.geometry import Pose3
from simscen.core.messages.sensor_data import imu_in_base_frame, level_scan
from simscen.model.sensors import InertialUnit, Lidar, Mount
from simscen.sensors.imu import ImuSensor
from simscen.sensors.lidar import LidarSensor
from simscen.sensors.sensor import SensorSetting

MOUNT_HEIGHT_M = 0.3
EXACT = {"gyro_noise": 0.0, "gyro_bias": 0.0, "accelerometer_noise": 0.0}


def scan(view, rays, mount, **spec):
    setting = SensorSetting("lidar", 24, 0.1, np.random.default_rng(1), view, rays, None)
    return LidarSensor(Lidar(noise=0.0, mount=Mount(z=MOUNT_HEIGHT_M, **mount), **spec), setting).read(24)


def imu(view, **mount):
    setting = SensorSetting("imu", 4, 1 / 60, np.random.default_rng(1), view, None, None)
    return ImuSensor(InertialUnit(**EXACT, mount=Mount(**mount)), setting)


@pytest.mark.parametrize("field_of_view", [2 * math.pi, math.radians(270)])
@pytest.mark.parametrize("yaw", [0.0, 0.7, math.pi])
def test_upside_down_lidar_reports_reversed_beams(field_of_view, yaw):
    view, room, mount = puppet_at(0.5, -0.3, 0.4), SquareRoom(3.0), {"x": 0.1, "yaw": yaw}
    upright = scan(view, room, mount, field_of_view=field_of_view, beams=271)
    inverted = scan(view, room, {**mount, "roll": math.pi}, field_of_view=field_of_view, beams=271)
    assert np.abs(inverted.ranges - upright.ranges).max() > 0.5
    # The first beam of a full circle, at -180 degrees, is the last beam of the inverted lidar.
    is_circle = field_of_view > 6
    assert level_scan(inverted).ranges == pytest.approx(np.roll(upright.ranges, -1) if is_circle else upright.ranges)
    assert level_scan(inverted).angle_min == pytest.approx(upright.angle_min + is_circle * upright.angle_increment)


def test_pitched_lidar_measures_the_floor_and_its_level_scan_does_not():
    pitch = math.radians(3)
    tilted = scan(puppet_at(0, 0), EmptyWorld(), {"pitch": pitch}, max_range=20.0)
    ahead = np.argmin(np.abs(tilted.angles()))
    assert tilted.ranges[ahead] == pytest.approx(MOUNT_HEIGHT_M / math.sin(pitch), abs=0.001)
    assert np.isposinf(tilted.ranges[0])  # the backward beams point up
    level = level_scan(tilted)
    assert np.isnan(level.ranges[ahead])
    assert np.isposinf(level.ranges[0])
    assert not len(level.points())


@pytest.mark.parametrize("yaw", [0.0, 1.0])
def test_level_lidar_measures_the_floor_when_the_robot_is_tilted(yaw):
    pitch = math.radians(3)
    view = Puppet(Pose3.from_rpy(1.0, 2.0, 0.05, 0.0, pitch, 0.7))
    measured = scan(view, EmptyWorld(), {"yaw": yaw}, max_range=20.0)
    # The lidar is 5 cm higher than on level ground, and the plane of its beams falls to the front of the robot.
    height = 0.05 + MOUNT_HEIGHT_M * math.cos(pitch)
    fall = math.sin(pitch) * np.cos(measured.angles() + yaw)
    with np.errstate(divide="ignore"):
        to_floor = np.where(fall > height / 20.0, height / fall, np.inf)
    assert np.isfinite(to_floor).sum() > 50
    assert measured.ranges == pytest.approx(to_floor, abs=0.001)


def test_level_lidar_does_not_measure_the_floor_beyond_its_range():
    view = Puppet(Pose3.from_rpy(0.0, 0.0, 0.0, 0.0, math.radians(1), 0.0))
    assert np.isposinf(scan(view, EmptyWorld(), {}, max_range=12.0).ranges).all()


@pytest.mark.parametrize("mount", [{"pitch": 0.03}, {"roll": 0.05}, {"pitch": -0.04, "roll": 0.02, "yaw": 1.0}])
def test_level_scan_of_a_tilted_lidar_shows_the_walls(mount):
    level = level_scan(scan(puppet_at(0.5, -0.3, 0.4), SquareRoom(3.0), mount))
    hits = puppet_at(0.5, -0.3, 0.4).pose.plane.apply(level.points())
    assert len(hits) > 300
    # The direction of a beam is off by at most half an increment, which has the largest effect in the corners.
    assert np.abs(np.abs(hits).max(axis=1) - 3.0).max() < math.hypot(3.5, 3.3) * level.angle_increment / 2


def test_hits_outside_the_angles_of_the_level_scan_are_ignored():
    tilted = scan(puppet_at(0, 0), SquareRoom(3.0), {"pitch": -0.4}, field_of_view=math.radians(90), beams=91)
    tilted = replace(tilted, ranges=np.where(tilted.angles() < math.radians(-43), 1.0, np.inf))
    assert (tilted.points()[:, 1] < 0).all()
    assert (level_scan(tilted).points()[:, 1] < 0).all()


def test_scan_of_a_level_lidar_is_not_converted():
    level = scan(puppet_at(0, 0), SquareRoom(3.0), {"yaw": 0.3})
    assert level_scan(level) is level


def test_tilted_imu_measures_gravity_along_its_own_axes():
    reading = imu(Puppet(), roll=math.pi).read(4)
    assert reading.linear_acceleration == pytest.approx((0.0, 0.0, -9.81))
    reading = imu(Puppet(), pitch=0.1).read(4)
    assert reading.linear_acceleration == pytest.approx((-9.81 * math.sin(0.1), 0.0, 9.81 * math.cos(0.1)))
    assert imu_in_base_frame(reading).linear_acceleration == pytest.approx((0.0, 0.0, 9.81))


@pytest.mark.parametrize(
    ("mount", "rate"), [({"roll": math.pi}, -2.0), ({"yaw": 1.0}, 2.0), ({"roll": math.pi / 2}, 0)]
)
def test_turn_rate_is_about_the_axes_of_the_imu(mount, rate):
    reading = imu(Puppet(angular=(0.0, 0.0, 2.0)), **mount).read(4)
    assert reading.angular_velocity[2] == pytest.approx(rate, abs=1e-12)
    assert imu_in_base_frame(reading).angular_velocity == pytest.approx((0.0, 0.0, 2.0))


def test_imu_beside_the_axis_of_a_turn_measures_centripetal_acceleration():
    rate, distance = 2.0, 0.4
    view = Puppet(angular=(0.0, 0.0, rate))
    sensor = imu(view, x=distance)
    view.pose = Pose3.from_rpy(0, 0, 0, 0, 0, rate / 60)
    forward, left, _ = sensor.read(4).linear_acceleration
    assert forward == pytest.approx(-(rate**2) * distance, rel=0.001)
    assert left == pytest.approx(
        rate**2 * distance * rate / 120, rel=0.01
    )  # the frame of the IMU turns during the period
