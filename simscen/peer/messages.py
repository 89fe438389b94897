"""Classes for the ROS 2 messages of the stack protocol, and functions that read and serialize them.

`read` deserializes a message that a stack receives. The functions that return bytes serialize messages (CDR) that a
stack sends. The message types are defined in common_interfaces, nav2_msgs, rcl_interfaces, and tf2_msgs of ROS 2
Humble. Only the planar part of most poses and velocities is used: x, y, yaw (m, rad) and vx, vy, wz (m/s, rad/s).
"""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING, Any, NamedTuple

from .cdr import Reader, Writer

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Stamp = tuple[int, int]  # seconds and nanoseconds


class Pose2D(NamedTuple):
    """geometry_msgs/msg/Pose2D: meters and radians."""

    x: float
    y: float
    yaw: float


class LaserScan(NamedTuple):
    """sensor_msgs/msg/LaserScan: beam k points at `angle_min + k * angle_increment`.

    By REP 117, a range is inf if nothing was hit, -inf if a hit was too close, and nan if the measurement is invalid.
    """

    stamp: Stamp
    frame: str
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: array[float]


class Odometry(NamedTuple):
    """nav_msgs/msg/Odometry in the plane: the pose of the frame `child` in `frame`, and its velocity in `child`.

    The covariances are 6 x 6, row by row, as in the message.
    """

    stamp: Stamp
    frame: str
    child: str
    pose: Pose2D
    vx: float
    vy: float
    wz: float
    pose_covariance: tuple[float, ...]
    twist_covariance: tuple[float, ...]


class Imu(NamedTuple):
    """sensor_msgs/msg/Imu: angular velocity about x, y, z in rad/s, and acceleration along x, y, z in m/s².

    The covariances are 3 x 3, row by row.
    """

    stamp: Stamp
    frame: str
    angular_velocity: tuple[float, float, float]
    linear_acceleration: tuple[float, float, float]
    angular_velocity_covariance: tuple[float, ...]
    linear_acceleration_covariance: tuple[float, ...]


class Image(NamedTuple):
    """sensor_msgs/msg/Image: `data` has `height` rows of `step` bytes. Encodings: rgb8, 32FC1 (depth in m)."""

    stamp: Stamp
    frame: str
    height: int
    width: int
    encoding: str
    step: int
    data: bytes


class OccupancyGrid(NamedTuple):
    """nav_msgs/msg/OccupancyGrid: cell (column, row) is `data[row * width + column]`, 0 … 100, or -1 if unknown.

    `resolution` is the size of a cell in m. `origin` is the pose of the outer corner of cell (0, 0).
    """

    stamp: Stamp
    frame: str
    resolution: float
    width: int
    height: int
    origin: Pose2D
    data: array[int]


class PoseWithCovariance(NamedTuple):
    """geometry_msgs/msg/PoseWithCovarianceStamped in the plane. The covariance is 6 x 6, row by row."""

    stamp: Stamp
    frame: str
    pose: Pose2D
    covariance: tuple[float, ...]


class Transform(NamedTuple):
    """A transform of tf2_msgs/msg/TFMessage: the pose x, y, z, qx, qy, qz, qw of the frame `child` in `frame`."""

    stamp: Stamp
    frame: str
    child: str
    pose: tuple[float, ...]

    @property
    def pose2d(self) -> Pose2D:
        """The planar part of the pose."""
        return _planar(self.pose)


def quaternion(yaw: float) -> tuple[float, float, float, float]:
    """Return the quaternion x, y, z, w of a rotation by `yaw` about the z axis."""
    return 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)


def _planar(pose: Sequence[float]) -> Pose2D:
    """Return the planar part of a pose x, y, z, qx, qy, qz, qw."""
    x, y, _, qx, qy, qz, qw = pose
    return Pose2D(x, y, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)))


def _header(reader: Reader) -> tuple[Stamp, str]:
    """Return the stamp and the frame of a std_msgs/msg/Header."""
    sec, nanosec = reader.take("iI")
    return (sec, nanosec), reader.string()


def _laser_scan(reader: Reader) -> LaserScan:
    stamp, frame = _header(reader)
    angle_min, angle_max, angle_increment, time_increment, scan_time, range_min, range_max = reader.take("7f")
    angles = angle_min, angle_max, angle_increment
    return LaserScan(stamp, frame, *angles, time_increment, scan_time, range_min, range_max, reader.numbers("f"))


def _odometry(reader: Reader) -> Odometry:
    stamp, frame = _header(reader)
    child = reader.string()
    pose, pose_covariance = reader.take("7d"), reader.take("36d")
    twist, twist_covariance = reader.take("6d"), reader.take("36d")
    return Odometry(stamp, frame, child, _planar(pose), twist[0], twist[1], twist[5], pose_covariance, twist_covariance)


def _imu(reader: Reader) -> Imu:
    stamp, frame = _header(reader)
    reader.take("13d")
    angular_velocity, angular_velocity_covariance = reader.take("3d"), reader.take("9d")
    acceleration, acceleration_covariance = reader.take("3d"), reader.take("9d")
    covariances = angular_velocity_covariance, acceleration_covariance
    return Imu(stamp, frame, angular_velocity, acceleration, *covariances)


def _image(reader: Reader) -> Image:
    stamp, frame = _header(reader)
    height, width = reader.take("2I")
    encoding = reader.string()
    reader.take("B")
    step, size = reader.take("2I")
    return Image(stamp, frame, height, width, encoding, step, reader.blob(size))


def _occupancy_grid(reader: Reader) -> OccupancyGrid:
    stamp, frame = _header(reader)
    reader.take("iI")
    (resolution,) = reader.take("f")
    width, height = reader.take("2I")
    origin = _planar(reader.take("7d"))
    return OccupancyGrid(stamp, frame, resolution, width, height, origin, reader.numbers("b"))


def _pose_with_covariance(reader: Reader) -> PoseWithCovariance:
    stamp, frame = _header(reader)
    return PoseWithCovariance(stamp, frame, _planar(reader.take("7d")), reader.take("36d"))


def _transforms(reader: Reader) -> list[Transform]:
    links = []
    for _ in range(reader.count()):
        stamp, frame = _header(reader)
        links.append(Transform(stamp, frame, reader.string(), reader.take("7d")))
    return links


def _float64_array(reader: Reader) -> array[float]:
    for _ in range(reader.count()):
        reader.string()
        reader.take("2I")
    reader.take("I")
    return reader.numbers("d")


READERS: dict[str, Callable[[Reader], Any]] = {
    "sensor_msgs/msg/LaserScan": _laser_scan,
    "nav_msgs/msg/Odometry": _odometry,
    "sensor_msgs/msg/Imu": _imu,
    "sensor_msgs/msg/Image": _image,
    "std_msgs/msg/Bool": lambda reader: bool(reader.take("B")[0]),
    "std_msgs/msg/String": lambda reader: reader.string(),
    "std_msgs/msg/Float64MultiArray": _float64_array,
    "nav_msgs/msg/OccupancyGrid": _occupancy_grid,
    "geometry_msgs/msg/PoseWithCovarianceStamped": _pose_with_covariance,
    "geometry_msgs/msg/Pose2D": lambda reader: Pose2D(*reader.take("3d")),
    "tf2_msgs/msg/TFMessage": _transforms,
}
"""Functions that read a message, by ROS type."""


def read(kind: str, data: bytes) -> Any:
    """Deserialize a message of the ROS type `kind`.

    Return an object of a class of this module, or a plain Python value, such as a bool for std_msgs/msg/Bool. Raises
    ValueError if `data` is not a message of this type.
    """
    return READERS[kind](Reader(data))


def twist(vx: float, vy: float, wz: float) -> bytes:
    """Return a planar geometry_msgs/msg/Twist: m/s forward, m/s to the left, rad/s counterclockwise."""
    return Writer().put("6d", vx, vy, 0.0, 0.0, 0.0, wz).done()


def string(text: str) -> bytes:
    """Return a std_msgs/msg/String."""
    return Writer().string(text).done()


def pose2d(x: float, y: float, yaw: float) -> bytes:
    """Return a geometry_msgs/msg/Pose2D."""
    return Writer().put("3d", x, y, yaw).done()


def float64_array(values: Sequence[float]) -> bytes:
    """Return a std_msgs/msg/Float64MultiArray whose layout has no dimensions."""
    return Writer().put("2I", 0, 0).numbers("d", values).done()


def pose_with_covariance(stamp: Stamp, pose: Sequence[float], covariance: Sequence[float]) -> bytes:
    """Return a geometry_msgs/msg/PoseWithCovarianceStamped in the map frame.

    `pose` is x, y, yaw. `covariance` is 3 x 3 for x, y, yaw, or 6 x 6 as in the message, row by row.
    """
    if len(covariance) == 9:
        c, expanded = covariance, [0.0] * 36
        for row, start in enumerate((0, 6, 30)):
            expanded[start], expanded[start + 1], expanded[start + 5] = c[3 * row], c[3 * row + 1], c[3 * row + 2]
        covariance = expanded
    x, y, yaw = pose
    return (
        Writer().put("iI", *stamp).string("map").put("7d", x, y, 0.0, *quaternion(yaw)).put("36d", *covariance).done()
    )


def odometry(
    stamp: Stamp, pose: Sequence[float], twist: Sequence[float], variances: Sequence[float] = (0.0, 0.0, 0.0)
) -> bytes:
    """Return a nav_msgs/msg/Odometry of base_link in the odom frame.

    `pose` is x, y, yaw, `twist` is vx, vy, wz, and `variances` are the variances of vx, vy, wz.
    """
    (x, y, yaw), (vx, vy, wz), twist_covariance = pose, twist, [0.0] * 36
    twist_covariance[0], twist_covariance[7], twist_covariance[35] = variances
    message = Writer().put("iI", *stamp).string("odom").string("base_link")
    message.put("7d", x, y, 0.0, *quaternion(yaw)).put("36d", *[0.0] * 36)
    return message.put("6d", vx, vy, 0.0, 0.0, 0.0, wz).put("36d", *twist_covariance).done()


def path(stamp: Stamp, poses: Sequence[Sequence[float]]) -> bytes:
    """Return a nav_msgs/msg/Path of poses x, y, yaw in the map frame."""
    message = Writer().put("iI", *stamp).string("map").put("I", len(poses))
    for x, y, yaw in poses:
        message.put("iI", *stamp).string("map").put("7d", x, y, 0.0, *quaternion(yaw))
    return message.done()


def occupancy_grid(
    stamp: Stamp, frame: str, resolution: float, width: int, origin: Sequence[float], cells: Sequence[int]
) -> bytes:
    """Return a nav_msgs/msg/OccupancyGrid.

    `cells` are rows of `width` cells, starting with the row of the lowest y. A cell is 0 … 100, or -1 if unknown.
    `resolution` is the size of a cell in m. `origin` is the pose x, y, yaw of the outer corner of the first cell.
    """
    x, y, yaw = origin
    message = Writer().put("iI", *stamp).string(frame).put("iI", *stamp).put("f", resolution)
    message.put("2I", width, len(cells) // width if width else 0).put("7d", x, y, 0.0, *quaternion(yaw))
    return message.numbers("b", cells).done()


def transforms(links: Sequence[tuple[Stamp, str, str, Sequence[float]]]) -> bytes:
    """Return a tf2_msgs/msg/TFMessage. A link is (stamp, frame, child frame, pose x, y, yaw of the child frame)."""
    message = Writer().put("I", len(links))
    for stamp, frame, child, (x, y, yaw) in links:
        message.put("iI", *stamp).string(frame).string(child).put("7d", x, y, 0.0, *quaternion(yaw))
    return message.done()


def particle_cloud(stamp: Stamp, particles: Sequence[Sequence[float]]) -> bytes:
    """Return a nav2_msgs/msg/ParticleCloud in the map frame. A particle is x, y, yaw, weight."""
    message = Writer().put("iI", *stamp).string("map").put("I", len(particles))
    for x, y, yaw, weight in particles:
        message.put("8d", x, y, 0.0, *quaternion(yaw), weight)
    return message.done()


BEHAVIOR_TREE_LOGGER = "behavior_tree"
"""Name of the logger for lines that `tree_change` returns."""


def tree_change(node: str, before: str, after: str) -> str:
    """Return the log line for a node of a behavior tree that changed its status, e.g. from `IDLE` to `RUNNING`."""
    return f"{node}: {before} -> {after}"


def log(stamp: Stamp, level: int, name: str, text: str) -> bytes:
    """Return an rcl_interfaces/msg/Log: `name` is the logger; `level` is 10 debug, 20 info, 30 warning, 40 error."""
    message = Writer().put("iI", *stamp).put("B", level)
    for field in (name, text, "", ""):
        message.string(field)
    return message.put("I", 0).done()
