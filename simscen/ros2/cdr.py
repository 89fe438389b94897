"""The little that the adapter reads and writes of CDR itself: headers, velocities and poses."""

import math
import struct
from typing import Sequence, Tuple

LITTLE_ENDIAN = b"\0\1\0\0"
NANOSECONDS = 10**9


def header(message: bytes) -> Tuple[int, str]:
    """Stamp in nanoseconds and frame of a message that begins with a std_msgs/Header."""
    order = "<" if message[1] & 1 else ">"
    seconds, rest, size = struct.unpack_from(order + "iII", message, 4)
    return seconds * NANOSECONDS + rest, message[16 : 16 + size - 1].decode("utf-8", "replace")


def velocity(message: bytes, stamped: bool) -> Tuple[float, ...]:
    """The six numbers of a Twist, or of the one in a TwistStamped: linear x, y, z, angular x, y, z."""
    order, start = ("<" if message[1] & 1 else ">"), 4
    if stamped:
        (size,) = struct.unpack_from(order + "I", message, 12)
        start += -(-(12 + size) // 8) * 8
    return struct.unpack_from(order + "6d", message, start)


def twist(numbers: Sequence[float]) -> bytes:
    """geometry_msgs/msg/Twist."""
    return LITTLE_ENDIAN + struct.pack("<6d", *numbers)


def time(nanoseconds: int) -> bytes:
    """rosgraph_msgs/msg/Clock."""
    return LITTLE_ENDIAN + struct.pack("<iI", nanoseconds // NANOSECONDS, nanoseconds % NANOSECONDS)


Pose = Tuple[float, float, float]
"""x, y in meters and yaw in radians."""


def yaw(x: float, y: float, z: float, w: float) -> float:
    """The heading of a quaternion."""
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def compose(a: Pose, b: Pose) -> Pose:
    """The pose `b`, which is given in the frame of `a`."""
    cos, sin = math.cos(a[2]), math.sin(a[2])
    return a[0] + cos * b[0] - sin * b[1], a[1] + sin * b[0] + cos * b[1], turned(a[2] + b[2])


def turned(angle: float) -> float:
    """`angle` between -π and π."""
    return math.atan2(math.sin(angle), math.cos(angle))
