"""Tests that the message packers write the same bytes as rosbags."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from schemas_from_rosbags import humble

from simscen.core.clock import Stamp
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Scan
from simscen.peer import messages
from simscen.record.messages import encode, message_templates

STORE = humble()
names = st.text(max_size=20)
seeds = st.integers(0, 2**32 - 1)
stamps = st.tuples(st.integers(0, 2**31 - 1), st.integers(0, 999_999_999))


def make(name: str, *fields: Any) -> Any:
    """Return a ROS message of rosbags."""
    package, short = name.split("/")
    return STORE.types[f"{package}/msg/{short}"](*fields)


def serialized(message: Any) -> bytes:
    return bytes(STORE.serialize_cdr(message, message.__msgtype__))


def header(stamp: Stamp, frame: str) -> Any:
    return make("std_msgs/Header", make("builtin_interfaces/Time", *stamp), frame)


def vector(*xyz: float) -> Any:
    return make("geometry_msgs/Vector3", *map(float, xyz))


def ros_pose(pose: Pose3) -> Any:
    position = make("geometry_msgs/Point", *map(float, pose.position))
    return make("geometry_msgs/Pose", position, make("geometry_msgs/Quaternion", *map(float, pose.quaternion)))


def ros_twist(twist: Twist) -> Any:
    return make("geometry_msgs/Twist", vector(twist.vx, twist.vy, 0), vector(0, 0, twist.wz))


def planar(row: Any) -> Pose3:
    """Return the 3D pose of a row x, y, yaw.

    The packers use the sine and cosine of numpy, which may round differently than those of Python.
    """
    half = np.array([row[2]]) / 2
    return Pose3(float(row[0]), float(row[1]), 0.0, 0.0, 0.0, float(np.sin(half)[0]), float(np.cos(half)[0]))


def pose3(rng: np.random.Generator) -> Pose3:
    return Pose3(*rng.normal(size=7).tolist())


@given(stamps)
def test_clock_bytes_equal_those_of_rosbags(stamp: Stamp) -> None:
    assert message_templates.clock().packer()(stamp) == serialized(
        make("rosgraph_msgs/Clock", make("builtin_interfaces/Time", *stamp))
    )


@given(st.floats(allow_nan=False))
def test_float64_bytes_equal_those_of_rosbags(value: float) -> None:
    assert message_templates.float64().packer()(value) == serialized(make("std_msgs/Float64", value))


@given(seeds)
def test_twist_bytes_equal_those_of_rosbags(seed: int) -> None:
    twist = Twist(*np.random.default_rng(seed).normal(size=3).tolist())
    assert message_templates.twist().packer()(twist) == serialized(ros_twist(twist))


@given(seeds, stamps, names, names)
def test_odometry_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str, child: str) -> None:
    rng = np.random.default_rng(seed)
    pose, twist = pose3(rng), Twist(*rng.normal(size=3).tolist())
    expected = make(
        "nav_msgs/Odometry",
        header(stamp, frame),
        child,
        make("geometry_msgs/PoseWithCovariance", ros_pose(pose), np.zeros(36)),
        make("geometry_msgs/TwistWithCovariance", ros_twist(twist), np.zeros(36)),
    )
    assert message_templates.odometry(frame, child).packer()(stamp, pose, twist) == serialized(expected)


@given(seeds, stamps, names, names)
def test_odometry_with_covariance_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str, child: str) -> None:
    rng = np.random.default_rng(seed)
    pose, twist = pose3(rng), Twist(*rng.normal(size=3).tolist())
    covariance, variances = rng.normal(size=(3, 3)), rng.normal(size=3)
    pose_covariance, twist_covariance = np.zeros((6, 6)), np.zeros((6, 6))
    pose_covariance[np.ix_([0, 1, 5], [0, 1, 5])] = covariance
    twist_covariance[[0, 1, 5], [0, 1, 5]] = variances
    expected = make(
        "nav_msgs/Odometry",
        header(stamp, frame),
        child,
        make("geometry_msgs/PoseWithCovariance", ros_pose(pose), pose_covariance.ravel()),
        make("geometry_msgs/TwistWithCovariance", ros_twist(twist), twist_covariance.ravel()),
    )
    pack = message_templates.odometry_with_covariance(frame, child).packer()
    assert pack(stamp, pose, covariance.ravel().tolist(), twist, variances.tolist()) == serialized(expected)


@given(seeds, stamps, names)
def test_imu_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str) -> None:
    rng = np.random.default_rng(seed)
    turn_rate, force = tuple(rng.normal(size=3).tolist()), tuple(rng.normal(size=3).tolist())
    unknown = np.zeros(9)
    unknown[0] = -1
    expected = make(
        "sensor_msgs/Imu",
        header(stamp, frame),
        make("geometry_msgs/Quaternion", 0.0, 0.0, 0.0, 1.0),
        unknown,
        vector(*turn_rate),
        0.25 * np.eye(3).ravel(),
        vector(*force),
        0.5 * np.eye(3).ravel(),
    )
    assert message_templates.imu(frame).packer()(stamp, turn_rate, 0.25, force, 0.5) == serialized(expected)


@given(seeds, stamps, names)
def test_pose_with_covariance_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str) -> None:
    rng = np.random.default_rng(seed)
    pose, covariance = pose3(rng), rng.normal(size=(3, 3))
    full = np.zeros((6, 6))
    full[np.ix_([0, 1, 5], [0, 1, 5])] = covariance
    with_covariance = make("geometry_msgs/PoseWithCovariance", ros_pose(pose), full.ravel())
    expected = make("geometry_msgs/PoseWithCovarianceStamped", header(stamp, frame), with_covariance)
    assert message_templates.pose_with_covariance(frame).packer()(
        stamp, pose, covariance.ravel().tolist()
    ) == serialized(expected)


@given(seeds, stamps, names)
def test_pose_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str) -> None:
    pose = pose3(np.random.default_rng(seed))
    expected = make("geometry_msgs/PoseStamped", header(stamp, frame), ros_pose(pose))
    assert message_templates.pose_stamped(frame).packer()(stamp, pose) == serialized(expected)


@given(seeds, stamps, names, st.integers(0, 40))
def test_scan_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str, beams: int) -> None:
    rng = np.random.default_rng(seed)
    ranges = rng.choice([np.inf, np.nan, 1.234, 20.0], size=beams)
    scan = Scan("lidar", 0, ranges, -3.0, 0.1, 0.05, 20.0)
    expected = make(
        "sensor_msgs/LaserScan",
        header(stamp, frame),
        *(-3.0, -3.0 + 0.1 * (beams - 1), 0.1, 0.0, 0.0, 0.05, 20.0),
        ranges.astype(np.float32),
        np.empty(0, dtype=np.float32),
    )
    assert encode.laser_scan(frame, stamp, scan) == serialized(expected)


@given(seeds, stamps, names, st.integers(0, 12))
def test_path_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str, length: int) -> None:
    points = np.random.default_rng(seed).normal(size=(length, 3))
    poses = [make("geometry_msgs/PoseStamped", header(stamp, frame), ros_pose(planar(row))) for row in points]
    expected = make("nav_msgs/Path", header(stamp, frame), poses)
    assert encode.path(frame, stamp, points) == serialized(expected)


@given(seeds, stamps, names, st.integers(1, 12))
def test_particle_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str, count: int) -> None:
    rows = np.random.default_rng(seed).normal(size=(count, 4))
    particles = [make("nav2_msgs/Particle", ros_pose(planar(row)), float(row[3])) for row in rows]
    expected = make("nav2_msgs/ParticleCloud", header(stamp, frame), particles)
    assert encode.particle_cloud(frame, stamp, rows) == serialized(expected)


@given(seeds, st.lists(st.tuples(names, names, stamps), max_size=5))
def test_transform_bytes_equal_those_of_rosbags(seed: int, links: list[tuple[str, str, Stamp]]) -> None:
    rng = np.random.default_rng(seed)
    transforms_with_pose = [(*link, pose3(rng)) for link in links]
    transforms = [
        make(
            "geometry_msgs/TransformStamped",
            header(stamp, frame),
            child,
            make("geometry_msgs/Transform", vector(*pose.position), ros_pose(pose).orientation),
        )
        for frame, child, stamp, pose in transforms_with_pose
    ]
    assert encode.tf_message(transforms_with_pose) == serialized(make("tf2_msgs/TFMessage", transforms))


@given(seeds, stamps, names, st.integers(0, 9), st.integers(0, 9))
def test_grid_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str, height: int, width: int) -> None:
    cells = np.random.default_rng(seed).integers(-1, 101, size=(height, width), dtype=np.int8)
    origin = Pose2(-1.5, 2.25, 0.3)
    time = make("builtin_interfaces/Time", *stamp)
    info = make("nav_msgs/MapMetaData", time, 0.05, width, height, ros_pose(Pose3.planar(origin)))
    expected = make("nav_msgs/OccupancyGrid", header(stamp, frame), info, cells.ravel())
    assert encode.occupancy_grid(frame, stamp, OccupancyGrid(cells, 0.05, origin)) == serialized(expected)


@given(st.text(max_size=40))
def test_text_bytes_equal_those_of_rosbags(text: str) -> None:
    assert messages.string(text) == serialized(make("std_msgs/String", text))


@pytest.mark.parametrize("value", [True, False])
def test_bumper_bytes_equal_those_of_rosbags(value: bool) -> None:
    assert encode.boolean(value) == serialized(make("std_msgs/Bool", value))


@given(stamps, st.integers(0, 255), names, st.text(max_size=40))
def test_log_line_bytes_equal_those_of_rosbags(stamp: Stamp, level: int, name: str, text: str) -> None:
    expected = make("rcl_interfaces/Log", make("builtin_interfaces/Time", *stamp), level, name, text, "", "", 0)
    assert messages.log(stamp, level, name, text) == serialized(expected)


@settings(deadline=None)
@given(seeds, stamps, names, st.integers(0, 5), st.integers(0, 5))
def test_image_bytes_equal_those_of_rosbags(seed: int, stamp: Stamp, frame: str, height: int, width: int) -> None:
    rng = np.random.default_rng(seed)
    rgb = rng.integers(0, 256, size=(height, width, 3), dtype=np.uint8)
    depth = rng.uniform(0, 5, size=(height, width)).astype(np.float32)
    for pixels, encoding, step in ((rgb, "rgb8", 3 * width), (depth, "32FC1", 4 * width)):
        data = np.frombuffer(pixels.tobytes(), dtype=np.uint8)
        row = step if height else 0
        expected = make("sensor_msgs/Image", header(stamp, frame), height, width, encoding, 0, row, data)
        assert encode.image(frame, stamp, pixels) == serialized(expected)
