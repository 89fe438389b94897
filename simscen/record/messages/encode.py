"""ROS 2 messages of one size, laid out. `packer()` of a layout gives what packs its fields, which are named here.

Definitions: ROS 2 Humble's common_interfaces. Unknown covariances are zeros, as REP 145 and the message comments ask. A
`stamp` is when something was measured, a `twist` and the poses of a belief are of the ground.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from simscen.record.messages.cdr import Template
from simscen.record.simtime import Stamp

_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)
_TWIST = "2d24xd"
"""Six numbers, of which the ground knows vx, vy and wz."""
_COVARIANCE = "2d24x3d24xd144x2d24xd"
"""36 numbers, of which the ground knows those of x, y and yaw."""
_TWIST_VARIANCES = "d48xd216xd"
"""36 numbers: a diagonal matrix with the variances of vx, vy and wz."""


def clock() -> Template:
    """rosgraph_msgs/msg/Clock: stamp."""
    message = Template()
    message.slot("iI", "*stamp")
    return message


def float64() -> Template:
    """std_msgs/msg/Float64: value."""
    message = Template()
    message.slot("d", "value")
    return message


def twist() -> Template:
    """geometry_msgs/msg/Twist: twist."""
    message = Template()
    message.slot(_TWIST, "*twist")
    return message


def odometry(frame: str, child: str) -> Template:
    """nav_msgs/msg/Odometry without covariances: stamp, pose, twist.

    `child` is in `frame`, and its velocity in its own frame.
    """
    message = _stamped(frame)
    message.string(child)
    message.slot("7d", "*pose")
    message.put("36d", *[0.0] * 36)
    message.slot(_TWIST, "*twist")
    message.put("36d", *[0.0] * 36)
    return message


def odometry_with_covariance(frame: str, child: str) -> Template:
    """nav_msgs/msg/Odometry: stamp, pose, covariance, twist, variances.

    `covariance` contains the nine numbers over x, y, yaw; `variances` those of vx, vy, wz.
    """
    message = _stamped(frame)
    message.string(child)
    message.slot("7d", "*pose")
    message.slot(_COVARIANCE, "*covariance")
    message.slot(_TWIST, "*twist")
    message.slot(_TWIST_VARIANCES, "*variances")
    return message


def imu(frame: str) -> Template:
    """sensor_msgs/msg/Imu: stamp, turn, turn_variance, force, force_variance, with the same variance for each axis.

    It has no heading; the first orientation covariance says so with -1.
    """
    message = _stamped(frame)
    message.put("4d", *_NO_ROTATION)
    message.put("9d", -1.0, *[0.0] * 8)
    for vector in ("turn", "force"):
        message.slot("3d", f"*{vector}")
        for _ in range(2):
            message.slot("d24x", f"{vector}_variance")
        message.slot("d", f"{vector}_variance")
    return message


def pose_with_covariance(frame: str) -> Template:
    """geometry_msgs/msg/PoseWithCovarianceStamped: stamp, pose, covariance (the nine numbers over x, y, yaw)."""
    message = _stamped(frame)
    message.slot("7d", "*pose")
    message.slot(_COVARIANCE, "*covariance")
    return message


def pose_stamped(frame: str) -> Template:
    """geometry_msgs/msg/PoseStamped: stamp, pose."""
    message = _stamped(frame)
    message.slot("7d", "*pose")
    return message


def transforms(links: Sequence[tuple[str, str, str]], more: int = 0, size: int = 0) -> Template:
    """tf2_msgs/msg/TFMessage: stamp, and the poses of the links, each of which is a frame, its child, and the name of
    the field for the child's pose in the frame; and of so many `more`, packed already, of a `size` in bytes: packed.
    """
    message = Template()
    message.put("I", len(links) + more)
    for frame, child, pose in links:
        message.slot("iI", "*stamp")
        message.string(frame)
        message.string(child)
        message.slot("7d", f"*{pose}")
    if more:
        message.slot(f"{size}s", "packed")
    return message


def _stamped(frame: str) -> Template:
    message = Template()
    message.slot("iI", "*stamp")
    message.string(frame)
    return message


def string(text: str) -> bytes:
    """std_msgs/msg/String."""
    message = Template()
    message.string(text)
    return bytes(message.buffer)


def boolean(value: bool) -> bytes:
    """std_msgs/msg/Bool."""
    message = Template()
    message.put("B", value)
    return bytes(message.buffer)


def log(stamp: Stamp, level: int, name: str, text: str) -> bytes:
    """rcl_interfaces/msg/Log, without the place in a source file."""
    message = Template()
    message.put("iI", *stamp)
    message.put("B", level)
    for field in (name, text, "", ""):
        message.string(field)
    message.put("I", 0)
    return bytes(message.buffer)


def image(frame: str, stamp: Stamp, pixels: "npt.NDArray[np.uint8] | npt.NDArray[np.float32]") -> bytes:
    """sensor_msgs/msg/Image: (h, w, 3) uint8 as rgb8, (h, w) float32 as 32FC1 (REP 118: depth in meters)."""
    height, width = pixels.shape[:2]
    encoding, kind = ("rgb8", "u1") if pixels.ndim == 3 else ("32FC1", "<f4")
    content = pixels.astype(kind).tobytes()
    message = Template()
    message.put("iI", *stamp)
    message.string(frame)
    message.put("2I", height, width)
    message.string(encoding)
    message.put("B", 0)
    message.put("2I", len(content) // height if height else 0, len(content))
    return bytes(message.buffer) + content
