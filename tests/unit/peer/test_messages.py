"""Tests that the peer writes the same messages as simscen's log, and reads messages of simscen."""

import contextlib
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Scan
from simscen.peer import messages
from simscen.peer.cdr import Reader
from simscen.record.messages import encode, message_templates
from simscen.record.messages.decode import MessageReader, path

STAMP = (12, 345_000_000)
numbers = st.floats(-1e4, 1e4)
names = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9)
poses = st.lists(st.tuples(numbers, numbers, st.floats(-4, 4)), max_size=5)


@given(numbers, numbers, numbers)
def test_twist_equals_the_message_of_the_engine(vx: float, vy: float, wz: float) -> None:
    assert messages.twist(vx, vy, wz) == message_templates.twist().packer()(Twist(vx, vy, wz))


@given(poses)
def test_path_equals_the_message_of_the_engine(points) -> None:
    table = np.array(points, dtype=np.float64).reshape(-1, 3)
    ours, theirs = messages.path(STAMP, points), encode.path("map", STAMP, table)
    assert len(ours) == len(theirs)
    assert ours[:24] == theirs[:24]
    assert np.allclose(
        path(MessageReader(ours)).poses, path(MessageReader(theirs)).poses, rtol=1e-15, atol=1e-15
    )  # the sine of numpy and of the C library may differ in the last bit


@given(numbers, numbers, st.floats(-4, 4), st.lists(numbers, min_size=9, max_size=9))
def test_pose_with_covariance_equals_the_message_of_the_engine(x: float, y: float, yaw: float, covariance) -> None:
    theirs = message_templates.pose_with_covariance("map").packer()
    expected = theirs(STAMP, Pose3.planar(Pose2(x, y, yaw)), covariance)
    assert messages.pose_with_covariance(STAMP, (x, y, yaw), covariance) == expected


@given(names, names)
def test_transforms_lines_and_texts_equal_the_messages_of_the_engine(frame: str, text: str) -> None:
    link = (frame, text, STAMP, Pose3.planar(Pose2(1.0, 2.0, 0.5)))
    ours = (STAMP, frame, text, (1.0, 2.0, 0.5))
    assert messages.transforms([ours, ours]) == encode.tf_message([link, link])


def test_particles_equal_the_message_of_the_engine() -> None:
    cloud = [(1.0, 2.0, 0.0, 0.25), (3.0, 4.0, 1.0, 0.75)]
    assert messages.particle_cloud(STAMP, cloud) == encode.particle_cloud("map", STAMP, np.array(cloud))


@given(names, st.lists(st.floats(0, 100, width=32) | st.just(float("inf")), max_size=9))
def test_scan_is_unchanged_by_serialization(frame: str, ranges) -> None:
    scan = Scan("lidar", 0, np.array(ranges, dtype=np.float64), -1.5, 0.25, 0.5, 12.0)
    read = messages.read("sensor_msgs/msg/LaserScan", encode.laser_scan(frame, STAMP, scan))
    assert (read.stamp, read.frame, list(read.ranges)) == (STAMP, frame, ranges)
    assert (read.angle_min, read.angle_increment, read.range_min, read.range_max) == (-1.5, 0.25, 0.5, 12.0)


@given(numbers, numbers, st.floats(-3, 3), names)
def test_odometry_is_unchanged_by_serialization(x: float, y: float, yaw: float, frame: str) -> None:
    pack = message_templates.odometry_with_covariance(frame, "base").packer()
    covariance, variances = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0), (10.0, 11.0, 12.0)
    packed = pack(STAMP, Pose3.planar(Pose2(x, y, yaw)), covariance, Twist(x, y, yaw), variances)
    read = messages.read("nav_msgs/msg/Odometry", packed)
    assert tuple(read.pose_covariance[i] for i in (0, 1, 5, 6, 7, 11, 30, 31, 35)) == covariance
    assert tuple(read.twist_covariance[i] for i in (0, 7, 35)) == variances
    assert sum(read.pose_covariance) + sum(read.twist_covariance) == sum(covariance) + sum(variances)
    assert (read.stamp, read.frame, read.child, read.vx, read.vy, read.wz) == (STAMP, frame, "base", x, y, yaw)
    assert read.pose == pytest.approx((x, y, yaw))


def test_imu_picture_and_map_are_unchanged_by_serialization() -> None:
    packed = message_templates.imu("base").packer()(STAMP, (1.0, 2.0, 3.0), 0.25, (4.0, 5.0, 6.0), 0.5)
    read = messages.read("sensor_msgs/msg/Imu", packed)
    assert (read.angular_velocity, read.linear_acceleration) == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    assert read.angular_velocity_covariance == (0.25, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.25)
    assert read.linear_acceleration_covariance == (0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.5)
    picture = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    image = messages.read("sensor_msgs/msg/Image", encode.image("eye", STAMP, picture))
    assert (image.height, image.width, image.encoding, image.step, image.data) == (2, 4, "rgb8", 12, picture.tobytes())
    grid = OccupancyGrid(np.array([[0, 100, -1], [1, 2, 3]], dtype=np.int8), 0.5, Pose2(1.0, 2.0, 0.5))
    cells = messages.read("nav_msgs/msg/OccupancyGrid", encode.occupancy_grid("map", STAMP, grid))
    assert (cells.width, cells.height, list(cells.data), cells.resolution) == (3, 2, [0, 100, -1, 1, 2, 3], 0.5)
    assert cells.origin == pytest.approx((1.0, 2.0, 0.5))


@given(st.binary(max_size=200), st.sampled_from(sorted(messages.READERS)))
def test_bytes_that_are_no_message_are_refused(data: bytes, kind: str) -> None:
    with contextlib.suppress(ValueError):
        messages.read(kind, data)
    with pytest.raises(ValueError, match="not plain CDR"):
        Reader(b"\0\2\0\0" + data)


def test_big_endian_numbers_are_read() -> None:
    layout, count, padding = bytes(8), struct.pack(">I", 2), bytes(4)
    data = b"\0\0\0\0" + layout + count + padding + struct.pack(">2d", 0.5, -3.0)
    assert list(messages.read("std_msgs/msg/Float64MultiArray", data)) == [0.5, -3.0]
