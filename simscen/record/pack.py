"""ROS 2 messages of one size as bytes. A packer is made once for its frames and called for every message.

Definitions: ROS 2 Humble's common_interfaces. Covariances that nobody knows are zeros, as REP 145 and the message
comments ask.
"""

from simscen.core.geometry import Array, Pose3
from simscen.core.motion import Twist
from simscen.core.sensing import Imu
from simscen.record.cdr import Template
from simscen.record.simtime import Stamp

_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)


class ClockPacker:
    """rosgraph_msgs/msg/Clock."""

    def __init__(self) -> None:
        message = Template()
        self._clock = message.slot("iI")
        self._buffer = message.buffer

    def __call__(self, stamp: Stamp) -> bytes:
        """The message for simulated time `stamp`."""
        self._clock(*stamp)
        return bytes(self._buffer)


class Float64Packer:
    """std_msgs/msg/Float64."""

    def __init__(self) -> None:
        message = Template()
        self._data = message.slot("d")
        self._buffer = message.buffer

    def __call__(self, value: float) -> bytes:
        """The message for `value`."""
        self._data(value)
        return bytes(self._buffer)


class TwistPacker:
    """geometry_msgs/msg/Twist."""

    def __init__(self) -> None:
        message = Template()
        self._twist = message.slot("6d")
        self._buffer = message.buffer

    def __call__(self, twist: Twist) -> bytes:
        """The message for a velocity of the ground."""
        vx, vy, wz = twist
        self._twist(vx, vy, 0.0, 0.0, 0.0, wz)
        return bytes(self._buffer)


class OdometryPacker:
    """nav_msgs/msg/Odometry: where `child` is in `frame`, and its velocity in its own frame."""

    def __init__(self, frame: str, child: str) -> None:
        message = Template()
        self._stamp = message.slot("iI")
        message.string(frame)
        message.string(child)
        self._pose = message.slot("7d")
        message.put("36d", *[0.0] * 36)
        self._twist = message.slot("6d")
        message.put("36d", *[0.0] * 36)
        self._buffer = message.buffer

    def __call__(self, stamp: Stamp, pose: Pose3, twist: Twist) -> bytes:
        """The message for a pose and a velocity of the ground, measured at `stamp`."""
        vx, vy, wz = twist
        self._stamp(*stamp)
        self._pose(*pose)
        self._twist(vx, vy, 0.0, 0.0, 0.0, wz)
        return bytes(self._buffer)


class ImuPacker:
    """sensor_msgs/msg/Imu. It has no heading, which the first orientation covariance says with -1."""

    def __init__(self, frame: str) -> None:
        message = Template()
        self._stamp = message.slot("iI")
        message.string(frame)
        message.put("4d", *_NO_ROTATION)
        message.put("9d", -1.0, *[0.0] * 8)
        self._turn = message.slot("3d")
        message.put("9d", *[0.0] * 9)
        self._force = message.slot("3d")
        message.put("9d", *[0.0] * 9)
        self._buffer = message.buffer

    def __call__(self, stamp: Stamp, imu: Imu) -> bytes:
        """The message for a reading that was taken at `stamp`."""
        self._stamp(*stamp)
        self._turn(*imu.angular_velocity)
        self._force(*imu.linear_acceleration)
        return bytes(self._buffer)


class PoseWithCovariancePacker:
    """geometry_msgs/msg/PoseWithCovarianceStamped, for poses of the ground."""

    def __init__(self, frame: str) -> None:
        message = Template()
        self._stamp = message.slot("iI")
        message.string(frame)
        self._pose = message.slot("7d")
        self._covariance = message.slot("36d")
        self._buffer = message.buffer

    def __call__(self, stamp: Stamp, pose: Pose3, covariance: Array) -> bytes:
        """`covariance` (3, 3) is over (x, y, yaw); the message's is over (x, y, z, roll, pitch, yaw)."""
        xx, xy, xa, yx, yy, ya, ax, ay, aa = covariance.ravel().tolist()
        gap, row = (0.0, 0.0, 0.0), (0.0,) * 18
        self._stamp(*stamp)
        self._pose(*pose)
        self._covariance(xx, xy, *gap, xa, yx, yy, *gap, ya, *row, ax, ay, *gap, aa)
        return bytes(self._buffer)


class PoseStampedPacker:
    """geometry_msgs/msg/PoseStamped."""

    def __init__(self, frame: str) -> None:
        message = Template()
        self._stamp = message.slot("iI")
        message.string(frame)
        self._pose = message.slot("7d")
        self._buffer = message.buffer

    def __call__(self, stamp: Stamp, pose: Pose3) -> bytes:
        """The message for a pose at `stamp`."""
        self._stamp(*stamp)
        self._pose(*pose)
        return bytes(self._buffer)
