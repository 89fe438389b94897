"""The standard messages of a ROS 2 log, as far as a trace is made of them; a message that does not fit is refused.

Source: the definitions of ROS 2 Humble in common_interfaces; those used here have not changed since Foxy.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array
from simscen.record.messages.cdr import HEADER, CdrReader
from simscen.record.simtime import NS_PER_SECOND

Numbers = tuple[float, ...]

_UPPER_TRIANGLE = (0, 1, 5, 7, 11, 35)
_ON_THE_GROUND = (0, 1, 5)
_MAX_QUATERNION_ERROR = 0.1
NO_COVARIANCE: Numbers = (0.0,) * 6


class StampedPose(NamedTuple):
    """Where something is: `stamp` in nanoseconds, the frame it is told in, x, y, z and a unit quaternion.

    `covariance` is xx, xy, xyaw, yy, yyaw, yawyaw, zeros where the message has none; `twist` vx, vy, wz in the frame
    `child`, None where the message has none.
    """

    stamp: int
    frame: str
    pose: Numbers
    covariance: Numbers = NO_COVARIANCE
    twist: Numbers | None = None
    child: str = ""


class VelocityCommand(NamedTuple):
    """A velocity command vx, vy, wz; `stamp` is None where the message has no header."""

    stamp: int | None
    values: Numbers


class PathMessage(NamedTuple):
    """A path of poses (n, 7)."""

    stamp: int
    poses: Array


class GoalState(NamedTuple):
    """What an action server says of a goal: its id, when it was accepted, and action_msgs' status."""

    id: bytes
    accepted: int
    status: int


class ScanMessage(NamedTuple):
    """A planar scan: angles in rad, ranges (n,) in m, inf where nothing was hit."""

    stamp: int
    frame: str
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Array


def odometry(data: bytes) -> StampedPose:
    """nav_msgs/msg/Odometry."""
    cursor = _cursor(data)
    stamp, frame = _header(cursor)
    child, pose = cursor.string(), cursor.take("7d")
    covariance = cursor.take("36d")
    twist = cursor.take("6d")
    cursor.take("36d")
    _end(cursor)
    return StampedPose(
        stamp, frame, _unit(pose), _plane(covariance), tuple(twist[i] for i in _ON_THE_GROUND), _strip_slash(child)
    )


def pose_stamped(data: bytes) -> StampedPose:
    """geometry_msgs/msg/PoseStamped."""
    cursor = _cursor(data)
    stamp, frame = _header(cursor)
    pose = cursor.take("7d")
    _end(cursor)
    return StampedPose(stamp, frame, _unit(pose))


def pose_with_covariance_stamped(data: bytes) -> StampedPose:
    """geometry_msgs/msg/PoseWithCovarianceStamped."""
    cursor = _cursor(data)
    stamp, frame = _header(cursor)
    pose, covariance = cursor.take("7d"), cursor.take("36d")
    _end(cursor)
    return StampedPose(stamp, frame, _unit(pose), _plane(covariance))


def transforms(data: bytes) -> list[StampedPose]:
    """tf2_msgs/msg/TFMessage: where each `child` is in its parent `frame`."""
    cursor = _cursor(data)
    links = []
    for _ in range(cursor.count()):
        stamp, frame = _header(cursor)
        child = _strip_slash(cursor.string())
        links.append(StampedPose(stamp, frame, _unit(cursor.take("7d")), child=child))
    _end(cursor)
    return links


def twist(data: bytes) -> VelocityCommand:
    """geometry_msgs/msg/Twist."""
    cursor = _cursor(data)
    values = cursor.take("6d")
    _end(cursor)
    return VelocityCommand(None, tuple(values[i] for i in _ON_THE_GROUND))


def twist_stamped(data: bytes) -> VelocityCommand:
    """geometry_msgs/msg/TwistStamped, which Nav2 sends by default since Kilted."""
    cursor = _cursor(data)
    stamp, _ = _header(cursor)
    values = cursor.take("6d")
    _end(cursor)
    return VelocityCommand(stamp, tuple(values[i] for i in _ON_THE_GROUND))


def path(data: bytes) -> PathMessage:
    """nav_msgs/msg/Path."""
    cursor = _cursor(data)
    stamp, _ = _header(cursor)
    poses = []
    for _ in range(cursor.count()):
        _header(cursor)
        poses.append(_unit(cursor.take("7d")))
    _end(cursor)
    return PathMessage(stamp, np.array(poses, dtype=np.float64).reshape(-1, 7))


def scan_stamp(data: bytes) -> int:
    """When a sensor_msgs/msg/LaserScan was taken."""
    return _header(_cursor(data))[0]


def laser_scan(data: bytes) -> ScanMessage:
    """sensor_msgs/msg/LaserScan, without its intensities."""
    cursor = _cursor(data)
    stamp, frame = _header(cursor)
    first, _, step, _, _, least, most = cursor.take("7f")
    count = cursor.count()
    ranges = np.asarray(cursor.array("<f4" if data[1] else ">f4", (count,)), dtype=np.float64)
    cursor.array("<f4" if data[1] else ">f4", (cursor.count(),))
    _end(cursor)
    return ScanMessage(stamp, frame, first, step, least, most, ranges)


def goal_states(data: bytes) -> list[GoalState]:
    """action_msgs/msg/GoalStatusArray."""
    cursor = _cursor(data)
    states = []
    for _ in range(cursor.count()):
        identity = bytes(int(byte) for byte in cursor.take("16B"))
        sec, nanosec = cursor.take("iI")
        (status,) = cursor.take("b")
        states.append(GoalState(identity, int(sec) * NS_PER_SECOND + int(nanosec), int(status)))
    _end(cursor)
    return states


POSES: dict[str, Callable[[bytes], StampedPose]] = {
    "nav_msgs/msg/Odometry": odometry,
    "geometry_msgs/msg/PoseStamped": pose_stamped,
    "geometry_msgs/msg/PoseWithCovarianceStamped": pose_with_covariance_stamped,
}
"""The types that say where something is."""


def _cursor(data: bytes) -> CdrReader:
    if len(data) < len(HEADER) or data[0] != 0 or data[1] not in (0, 1):
        raise ValueError("a message is not plain CDR")
    return CdrReader(data, "<" if data[1] else ">")


def _header(cursor: CdrReader) -> tuple[int, str]:
    sec, nanosec = cursor.take("iI")
    return int(sec) * NS_PER_SECOND + int(nanosec), _strip_slash(cursor.string())


def _strip_slash(frame: str) -> str:
    """A frame without the slash that tf had and tf2 has not."""
    return frame.lstrip("/")


def _end(cursor: CdrReader) -> None:
    if cursor.left > 3:
        raise ValueError("a message is longer than its type")


def _plane(covariance: Numbers) -> Numbers:
    return tuple(covariance[i] for i in _UPPER_TRIANGLE)


def _unit(pose: Numbers) -> Numbers:
    """The pose with a quaternion of length 1. Raises ValueError for one that is no rotation: nobody filled it in."""
    norm = math.hypot(*pose[3:])
    if not abs(norm - 1.0) < _MAX_QUATERNION_ERROR:
        raise ValueError("an orientation is not a quaternion of length 1")
    return (*pose[:3], *(value / norm for value in pose[3:]))
