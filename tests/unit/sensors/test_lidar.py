"""Tests of the lidar: geometry of the beams, range limits, mount, and noise."""

import math
from dataclasses import replace

import numpy as np
import pytest
from puppet import EmptyWorld, Puppet, SquareRoom, puppet_at

from simscen.core.geometry import Pose3
from simscen.core.geometry.ray_fans import RayCaster
from simscen.model.sensors import Lidar, Mount
from simscen.sensors.lidar import LidarSensor
from simscen.sensors.sensor import SensorSetting

QUIET = {"noise": 0.0, "mount": Mount(z=0.2)}


def lidar(view, rays, seed=1, **spec):
    setting = SensorSetting("lidar", 24, 0.1, np.random.default_rng(seed), view, rays, None)
    return LidarSensor(Lidar(**spec), setting)


def test_ranges_in_a_square_room_are_exact_within_half_the_resolution():
    scan = lidar(puppet_at(0.5, -0.3, 0.4), SquareRoom(3.0), **QUIET).read(24)
    x, y = scan.points().T
    hits = puppet_at(0.5, -0.3, 0.4).pose.plane.apply(np.column_stack((x, y)))
    assert np.abs(np.abs(hits).max(axis=1) - 3.0).max() <= 0.0005 + 1e-9
    assert len(hits) == 360
    assert (scan.sensor, scan.tick) == ("lidar", 24)


def test_ranges_are_multiples_of_the_resolution():
    for resolution in (0.001, 0.01):
        ranges = lidar(puppet_at(0, 0), SquareRoom(3.0), resolution=resolution).read(0).ranges
        assert np.allclose(ranges / resolution, np.round(ranges / resolution), atol=1e-6)


def test_full_circle_starts_at_the_back_and_has_each_direction_once():
    scan = lidar(puppet_at(0, 0), EmptyWorld(), beams=360).read(0)
    assert scan.angle_min == pytest.approx(-math.pi)
    assert scan.angles()[-1] + scan.angle_increment == pytest.approx(math.pi)


def test_partial_field_of_view_has_beams_on_both_edges():
    scan = lidar(puppet_at(0, 0), EmptyWorld(), beams=720, field_of_view=math.radians(270)).read(0)
    assert scan.angles()[0] == pytest.approx(-math.radians(135))
    assert scan.angles()[-1] == pytest.approx(math.radians(135))
    assert len(scan.ranges) == 720


def test_single_beam_points_forward():
    scan = lidar(puppet_at(1, 0), SquareRoom(3.0), beams=1, field_of_view=0.1, **QUIET).read(0)
    assert scan.angles().tolist() == [0.0]
    assert scan.ranges == pytest.approx([2.0])


def test_ranges_out_of_bounds_follow_rep_117():
    assert np.isposinf(lidar(puppet_at(0, 0), EmptyWorld()).read(0).ranges).all()
    assert np.isposinf(lidar(puppet_at(0, 0), SquareRoom(3.0), max_range=2.0).read(0).ranges).all()
    assert np.isneginf(lidar(puppet_at(0, 0), SquareRoom(3.0), min_range=5.0).read(0).ranges).all()


def test_mount_sets_position_and_direction_of_the_lidar():
    mount = Mount(x=0.5, y=0.1, z=0.3, yaw=math.pi / 2)
    scan = lidar(puppet_at(0, 0), SquareRoom(3.0), noise=0.0, mount=mount).read(0)
    ahead = scan.ranges[180]  # the beam at angle 0 of the lidar, which looks to the left
    assert ahead == pytest.approx(3.0 - 0.1)
    assert np.abs(np.abs(scan.points()).max(axis=1) - 3.0).max() <= 0.0006


def test_beams_of_a_tilted_robot_point_upward():
    casts = []

    class RecordingCaster(RayCaster):
        def cast(self, origins, directions, reach=math.inf):
            casts.append((origins[0], directions[180]))
            return np.ones(len(origins))

    lidar(Puppet(Pose3.from_rpy(0, 0, 0, 0, -0.1, 0)), RecordingCaster(), **QUIET).read(0)
    origin, ahead = casts[0]
    assert ahead == pytest.approx([math.cos(0.1), 0.0, math.sin(0.1)])
    assert origin == pytest.approx([-0.2 * math.sin(0.1), 0.0, 0.2 * math.cos(0.1)])


def test_noise_has_the_specified_moments():
    sensor = lidar(puppet_at(0, 0), SquareRoom(3.0), noise=0.02)
    quiet = lidar(puppet_at(0, 0), SquareRoom(3.0), **QUIET).read(0).ranges
    errors = np.concatenate([sensor.read(k).ranges - quiet for k in range(200)])
    count = len(errors)
    assert abs(errors.mean()) < 4 * 0.02 / math.sqrt(count)
    assert errors.std() == pytest.approx(0.02, rel=4 / math.sqrt(2 * count))
    z = errors / errors.std()
    assert abs((z**4).mean() - 3.0) < 4 * math.sqrt(24 / count)  # the kurtosis of a normal distribution


def test_noise_of_neighboring_beams_and_scans_is_independent():
    sensor = lidar(puppet_at(0, 0), SquareRoom(3.0), noise=0.02)
    quiet = lidar(puppet_at(0, 0), SquareRoom(3.0), **QUIET).read(0).ranges
    errors = np.array([sensor.read(k).ranges - quiet for k in range(100)]) / 0.02
    bound = 4 / math.sqrt(errors.size)
    assert abs((errors[:, 1:] * errors[:, :-1]).mean()) < bound
    assert abs((errors[1:] * errors[:-1]).mean()) < bound


def test_next_reading_does_not_change_an_earlier_scan():
    sensor = lidar(puppet_at(0, 0), SquareRoom(3.0))
    first = sensor.read(0)
    copy = replace(first, ranges=first.ranges.copy())
    sensor.read(24)
    assert np.array_equal(first.ranges, copy.ranges)
