"""Decoders of ROS 2 messages (CDR) from logs and external stacks.

A decoder takes the reader of one message. MessageReader is for messages from simscen. CheckedReader is for messages of
other programs. Stamps are in nanoseconds.
"""

import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from simscen.core.clock import NS_PER_SECOND
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.records.trace import LogLine
from simscen.peer.cdr import Reader

Numbers = tuple[float, ...]
"""Numbers in a fixed order, such as x, y, z and a quaternion x, y, z, w for a pose."""
T = TypeVar("T")

_COVARIANCE_INDICES = (0, 1, 5, 7, 11, 35)
"""Indices of xx, xy, xyaw, yy, yyaw, yawyaw in the 36 numbers of a covariance."""
_PLANAR_TWIST_INDICES = (0, 1, 5)
"""Indices of vx, vy, wz in the six numbers of a twist."""
_MAX_QUATERNION_NORM_ERROR = 0.1
"""Maximum difference of the length of a quaternion from 1."""
NO_COVARIANCE: Numbers = (0.0,) * 6
"""Covariance of a pose whose message has none: xx, xy, xyaw, yy, yyaw, yawyaw."""


class InvalidOrientation(ValueError):
    """The length of the quaternion of a pose in a message is far from 1."""

    def __init__(self) -> None:
        super().__init__("an orientation is not a quaternion of length 1")


class MessageReader(Reader):
    """Reads the fields of a message without changing their values."""

    @property
    def remaining(self) -> int:
        """Number of bytes that have not been read."""
        return len(self._data) - self.offset

    def array(self, type_code: str, shape: tuple[int, ...]) -> npt.NDArray[np.generic]:
        """Return the next numbers as an array. `type_code` is a numpy type without byte order, e.g. "f8".

        Raises ValueError if the message is too short.
        """
        dtype, size = np.dtype(self.byte_order + type_code), math.prod(shape)
        if size:  # an empty sequence at the end of a message has no padding
            self._align(dtype.itemsize)
        return np.frombuffer(self._data, dtype, size, self._skip(size * dtype.itemsize)).reshape(shape)

    def frame(self) -> str:
        """Return the name of the next frame."""
        return self.string()

    def header(self) -> tuple[int, str]:
        """Return the stamp in nanoseconds and the frame of a std_msgs/msg/Header."""
        seconds, nanoseconds = self.take("iI")
        return int(seconds) * NS_PER_SECOND + int(nanoseconds), self.frame()

    def pose(self) -> Numbers:
        """Return x, y, z and the quaternion of a geometry_msgs/msg/Pose or Transform.

        Raises InvalidOrientation if the length of the quaternion is far from 1. A quaternion with nan is allowed.
        """
        pose = self.take("7d")
        if abs(math.hypot(*pose[3:]) - 1.0) > _MAX_QUATERNION_NORM_ERROR:
            raise InvalidOrientation
        return pose


class CheckedReader(MessageReader):
    """Reads a message of another program: normalizes quaternions, and removes leading slashes of frames."""

    frame_prefix = ""
    """Prefix that is removed from the names of frames."""

    def frame(self) -> str:
        """Return the name of the next frame without leading slashes and without `frame_prefix`."""
        return self.string().lstrip("/").removeprefix(self.frame_prefix)

    def pose(self) -> Numbers:
        """Return the next pose with a normalized quaternion.

        Raises InvalidOrientation if the length of the quaternion in the message is far from 1, or nan.
        """
        pose = self.take("7d")
        norm = math.hypot(*pose[3:])
        if not abs(norm - 1.0) < _MAX_QUATERNION_NORM_ERROR:
            raise InvalidOrientation
        return (*pose[:3], *(value / norm for value in pose[3:]))


def decode_checked(decoder: Callable[[MessageReader], T], data: bytes, frame_prefix: str = "") -> T:
    """Decode a message of another program with a CheckedReader. Raises ValueError if the message is invalid."""
    reader = CheckedReader(data)
    reader.frame_prefix = frame_prefix
    message = decoder(reader)
    if reader.remaining > 3:  # up to three bytes of padding
        raise ValueError("a message is longer than its type")
    return message


class StampedPose(NamedTuple):
    """Pose of the frame `child` in `frame`: x, y, z and a quaternion x, y, z, w.

    child:       "" if the message does not contain it
    covariance:  xx, xy, xyaw, yy, yyaw, yawyaw; zeros if the message has none
    twist:       vx, vy, wz in the frame `child`; None if the message has none
    """

    stamp: int
    frame: str
    pose: Numbers
    covariance: Numbers = NO_COVARIANCE
    twist: Numbers | None = None
    child: str = ""


class VelocityCommand(NamedTuple):
    """Velocity command: `values` are vx, vy, wz. `stamp` is None if the message has no header."""

    stamp: int | None
    values: Numbers


class PathMessage(NamedTuple):
    """Path: poses (n, 7), each x, y, z and a quaternion x, y, z, w."""

    stamp: int
    poses: Array


class GoalState(NamedTuple):
    """State of a goal of an action server: ID, time of acceptance in ns, and a value of action_msgs/msg/GoalStatus."""

    id: bytes
    accept_time: int
    status: int


class ScanMessage(NamedTuple):
    """Planar scan with angles in rad, and ranges (n,) in m. The range of a beam without a hit is inf."""

    stamp: int
    frame: str
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Array


def odometry(reader: MessageReader) -> StampedPose:
    """Decode nav_msgs/msg/Odometry."""
    stamp, frame = reader.header()
    child, pose, covariance = reader.frame(), reader.pose(), reader.take("36d")
    twist = _planar_twist(reader)
    reader.take("36d")
    return StampedPose(stamp, frame, pose, _planar_covariance(covariance), twist, child)


def pose_stamped(reader: MessageReader) -> StampedPose:
    """Decode geometry_msgs/msg/PoseStamped."""
    stamp, frame = reader.header()
    return StampedPose(stamp, frame, reader.pose())


def pose_with_covariance_stamped(reader: MessageReader) -> StampedPose:
    """Decode geometry_msgs/msg/PoseWithCovarianceStamped."""
    stamp, frame = reader.header()
    pose = reader.pose()
    return StampedPose(stamp, frame, pose, _planar_covariance(reader.take("36d")))


def transforms(reader: MessageReader) -> list[StampedPose]:
    """Decode tf2_msgs/msg/TFMessage."""
    transforms = []
    for _ in range(reader.count()):
        stamp, frame = reader.header()
        child = reader.frame()
        transforms.append(StampedPose(stamp, frame, reader.pose(), child=child))
    return transforms


def twist(reader: MessageReader) -> VelocityCommand:
    """Decode geometry_msgs/msg/Twist."""
    return VelocityCommand(None, _planar_twist(reader))


def twist_stamped(reader: MessageReader) -> VelocityCommand:
    """Decode geometry_msgs/msg/TwistStamped, the default of Nav2 since Kilted."""
    stamp, _ = reader.header()
    return VelocityCommand(stamp, _planar_twist(reader))


def path(reader: MessageReader) -> PathMessage:
    """Decode nav_msgs/msg/Path."""
    stamp, _ = reader.header()
    poses = []
    for _ in range(reader.count()):
        reader.header()
        poses.append(reader.pose())
    return PathMessage(stamp, np.array(poses, dtype=np.float64).reshape(-1, 7))


def laser_scan(reader: MessageReader) -> ScanMessage:
    """Decode sensor_msgs/msg/LaserScan without its intensities."""
    stamp, frame = reader.header()
    angle_min, _, angle_increment, _, _, range_min, range_max = reader.take("7f")
    ranges = reader.array("f4", (reader.count(),)).astype(np.float64)
    reader.array("f4", (reader.count(),))
    return ScanMessage(stamp, frame, angle_min, angle_increment, range_min, range_max, ranges)


def particle_cloud(reader: MessageReader) -> Array:
    """Decode nav2_msgs/msg/ParticleCloud: particles (n, 8), each x, y, z, a quaternion x, y, z, w, and the weight."""
    reader.header()
    return reader.array("f8", (reader.count(), 8)).astype(np.float64)


def occupancy_grid(reader: MessageReader) -> tuple[str, OccupancyGrid]:
    """Decode nav_msgs/msg/OccupancyGrid. Return its frame, and the grid, whose resolution has 32-bit precision."""
    _, frame = reader.header()
    reader.take("iI")
    (resolution,) = reader.take("f")
    width, height = (int(n) for n in reader.take("2I"))
    origin = Pose3(*reader.take("7d")).plane
    reader.count()
    cells = reader.array("i1", (height, width)).astype(np.int8)
    return frame, OccupancyGrid(cells, resolution, Pose2(*origin))


def log_line(reader: MessageReader) -> LogLine:
    """Decode rcl_interfaces/msg/Log."""
    reader.take("iI")
    (level,) = reader.take("B")
    return LogLine(int(level), reader.string(), reader.string())


def goal_states(reader: MessageReader) -> list[GoalState]:
    """Decode action_msgs/msg/GoalStatusArray."""
    states = []
    for _ in range(reader.count()):
        goal_id = bytes(int(byte) for byte in reader.take("16B"))
        seconds, nanoseconds = reader.take("iI")
        (status,) = reader.take("b")
        states.append(GoalState(goal_id, int(seconds) * NS_PER_SECOND + int(nanoseconds), int(status)))
    return states


POSE_DECODERS: dict[str, Callable[[MessageReader], StampedPose]] = {
    "nav_msgs/msg/Odometry": odometry,
    "geometry_msgs/msg/PoseStamped": pose_stamped,
    "geometry_msgs/msg/PoseWithCovarianceStamped": pose_with_covariance_stamped,
}
"""Decoders of messages that contain one pose, by message type."""


def _planar_twist(reader: MessageReader) -> Numbers:
    """Return vx, vy, wz of the next geometry_msgs/msg/Twist."""
    values = reader.take("6d")
    return tuple(values[i] for i in _PLANAR_TWIST_INDICES)


def _planar_covariance(covariance: Numbers) -> Numbers:
    """Return xx, xy, xyaw, yy, yyaw, yawyaw of a 6 x 6 covariance."""
    return tuple(covariance[i] for i in _COVARIANCE_INDICES)
