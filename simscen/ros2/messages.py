"""Functions for message types, for a few serialized (CDR) messages, and for 2D poses."""

import functools
import importlib
import math
import struct
from typing import Any, Optional, Sequence, Tuple

LITTLE_ENDIAN = b"\0\1\0\0"
"""Header of four bytes before a message in little-endian CDR."""
NS_PER_S = 10**9
"""Nanoseconds per second."""
TRANSFORMS_TYPE, PATH_TYPE = "tf2_msgs/msg/TFMessage", "nav_msgs/msg/Path"
SCAN_TYPE, ODOMETRY_TYPE = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
POSE_BYTES = 56
"""Size of a pose or transform in CDR: seven doubles."""

Pose = Tuple[float, float, float]
"""x and y in meters, yaw in radians."""


def find_type(name: str) -> Optional[Any]:
    """Return the class of a message, service or action, e.g. `nav_msgs/msg/Odometry`; None if it is not installed."""
    package, kind, name = name.split("/")
    try:
        module = importlib.import_module(f"{package}.{kind}")
    except ModuleNotFoundError as error:
        if error.name is not None and error.name.split(".")[0] != package:
            raise
        return None
    return getattr(module, name, None)


def read_header(message: bytes) -> Tuple[int, str]:
    """Return the stamp in ns and the frame of a serialized message that begins with a std_msgs/Header."""
    order = _byte_order(message)
    seconds, nanoseconds, size = struct.unpack_from(order + "iII", message, 4)
    return seconds * NS_PER_S + nanoseconds, message[16 : 16 + size - 1].decode("utf-8", "replace")


def read_twist(message: bytes, is_stamped: bool) -> Tuple[float, ...]:
    """Return linear x, y, z in m/s and angular x, y, z in rad/s of a serialized Twist (or TwistStamped)."""
    order, start = _byte_order(message), 4
    if is_stamped:
        (size,) = struct.unpack_from(order + "I", message, 12)
        start += -(-(12 + size) // 8) * 8
    return struct.unpack_from(order + "6d", message, start)


def write_twist(numbers: Sequence[float]) -> bytes:
    """Return a serialized geometry_msgs/msg/Twist of linear x, y, z and angular x, y, z."""
    return LITTLE_ENDIAN + struct.pack("<6d", *numbers)


def write_clock(nanoseconds: int) -> bytes:
    """Return a serialized rosgraph_msgs/msg/Clock."""
    return LITTLE_ENDIAN + struct.pack("<iI", nanoseconds // NS_PER_S, nanoseconds % NS_PER_S)


def shift_stamps(type_name: str, message: bytes, offset_ns: int) -> bytes:
    """Return the serialized message with `offset_ns` added to all of its stamps; a negative stamp becomes 0."""
    if not offset_ns:
        return message
    shifted = bytearray(message)
    if type_name == TRANSFORMS_TYPE:
        (count,) = struct.unpack_from(_byte_order(message) + "I", message, 4)
        position = 8
        for _ in range(count):
            position = _shift_header(shifted, _align(position, 4), offset_ns)
            position = _align(_skip_string(shifted, position), 8) + POSE_BYTES
    elif type_name == PATH_TYPE:
        position = _align(_shift_header(shifted, 4, offset_ns), 4)
        (count,) = struct.unpack_from(_byte_order(message) + "I", message, position)
        position += 4
        for _ in range(count):
            position = _align(_shift_header(shifted, _align(position, 4), offset_ns), 8) + POSE_BYTES
    elif _has_header(type_name):
        _shift_header(shifted, 4, offset_ns)
    return bytes(shifted)


@functools.lru_cache(maxsize=None)
def _has_header(type_name: str) -> bool:
    """Return whether a message type begins with a std_msgs/Header."""
    fields = find_type(type_name).get_fields_and_field_types()  # type: ignore[union-attr]
    return next(iter(fields.values()), "") == "std_msgs/Header"


def _shift_header(message: bytearray, position: int, offset_ns: int) -> int:
    """Add `offset_ns` to the stamp of the header at `position`; return the position after the header."""
    order = _byte_order(message)
    seconds, nanoseconds = struct.unpack_from(order + "iI", message, position)
    stamp = max(0, seconds * NS_PER_S + nanoseconds + offset_ns)
    struct.pack_into(order + "iI", message, position, *divmod(stamp, NS_PER_S))
    return _skip_string(message, position + 8)


def _skip_string(message: bytearray, position: int) -> int:
    """Return the position after the string at `position`."""
    position = _align(position, 4)
    (size,) = struct.unpack_from(_byte_order(message) + "I", message, position)
    return position + 4 + int(size)


def _align(position: int, width: int) -> int:
    """Return the next position that is aligned to `width` bytes, counted from the end of the CDR header."""
    return position + -(position - 4) % width


def _byte_order(message: Sequence[int]) -> str:
    return "<" if message[1] & 1 else ">"


def quaternion_yaw(x: float, y: float, z: float, w: float) -> float:
    """Return the yaw angle of a quaternion."""
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def compose(a: Pose, b: Pose) -> Pose:
    """Transform the pose `b` from the frame of `a` to the parent frame of `a`."""
    cos, sin = math.cos(a[2]), math.sin(a[2])
    return a[0] + cos * b[0] - sin * b[1], a[1] + sin * b[0] + cos * b[1], wrap_angle(a[2] + b[2])


def wrap_angle(angle: float) -> float:
    """Return `angle` between -π and π."""
    return math.atan2(math.sin(angle), math.cos(angle))
