"""Functions for message types, for a few serialized (CDR) messages, and for 2D poses."""

import functools
import importlib
import math
import struct
from typing import Any, Iterable, List, Optional, Sequence, Tuple

from simscen.peer.cdr import Reader, Writer

NS_PER_S = 10**9
"""Nanoseconds per second."""
TF, TF_STATIC = "/tf", "/tf_static"
TRANSFORMS_TYPE, PATH_TYPE = "tf2_msgs/msg/TFMessage", "nav_msgs/msg/Path"
SCAN_TYPE, ODOMETRY_TYPE = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"

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
    reader = Reader(message)
    seconds, nanoseconds = reader.take("iI")
    return seconds * NS_PER_S + nanoseconds, reader.string()


def read_twist(message: bytes, is_stamped: bool) -> Tuple[float, ...]:
    """Return linear x, y, z in m/s and angular x, y, z in rad/s of a serialized Twist (or TwistStamped)."""
    reader = Reader(message)
    if is_stamped:
        reader.take("iI")
        reader.string()
    return reader.take("6d")


def read_path(message: bytes) -> List[Tuple[float, float]]:
    """Return the points x, y in m of a serialized nav_msgs/msg/Path."""
    reader, points = Reader(message), []
    reader.take("iI")
    reader.string()
    for _ in range(reader.count()):
        reader.take("iI")
        reader.string()
        points.append(reader.take("7d")[:2])
    return points


def write_twist(numbers: Sequence[float]) -> bytes:
    """Return a serialized geometry_msgs/msg/Twist of linear x, y, z and angular x, y, z."""
    return Writer().put("6d", *numbers).done()


def write_clock(nanoseconds: int) -> bytes:
    """Return a serialized rosgraph_msgs/msg/Clock."""
    return Writer().put("iI", *divmod(nanoseconds, NS_PER_S)).done()


def shift_stamps(type_name: str, message: bytes, offset_ns: int) -> bytes:
    """Return the serialized message with `offset_ns` added to all of its stamps; a negative stamp becomes 0."""
    if not offset_ns:
        return message
    reader, shifted = Reader(message), bytearray(message)
    if type_name == TRANSFORMS_TYPE:
        for _ in range(reader.count()):
            _shift_header(reader, shifted, offset_ns)
            reader.string()
            reader.take("7d")
    elif type_name == PATH_TYPE:
        _shift_header(reader, shifted, offset_ns)
        for _ in range(reader.count()):
            _shift_header(reader, shifted, offset_ns)
            reader.take("7d")
    elif _has_header(type_name):
        _shift_header(reader, shifted, offset_ns)
    return bytes(shifted)


@functools.lru_cache(maxsize=None)
def _has_header(type_name: str) -> bool:
    """Return whether a message type begins with a std_msgs/Header."""
    fields = find_type(type_name).get_fields_and_field_types()  # type: ignore[union-attr]
    return next(iter(fields.values()), "") == "std_msgs/Header"


def _shift_header(reader: Reader, shifted: bytearray, offset_ns: int) -> None:
    """Read a header, and write its stamp plus `offset_ns` to the same place of `shifted`."""
    seconds, nanoseconds = reader.take("iI")
    stamp = max(0, seconds * NS_PER_S + nanoseconds + offset_ns)
    struct.pack_into(reader.byte_order + "iI", shifted, reader.offset - 8, *divmod(stamp, NS_PER_S))
    reader.string()


def transforms_first(messages: Iterable[Tuple[str, bytes]]) -> List[Tuple[str, bytes]]:
    """Return the messages (topic, CDR) with transforms first, otherwise in the same order."""
    # Nav2's collision monitor waits in a callback until it can transform its newest scan. Meanwhile, it does not answer
    # the node barrier, so that a later transform would never be published.
    return sorted(messages, key=lambda message: message[0] not in (TF, TF_STATIC))


def compose(a: Pose, b: Pose) -> Pose:
    """Transform the pose `b` from the frame of `a` to the parent frame of `a`."""
    cos, sin = math.cos(a[2]), math.sin(a[2])
    return a[0] + cos * b[0] - sin * b[1], a[1] + sin * b[0] + cos * b[1], wrap_angle(a[2] + b[2])


def wrap_angle(angle: float) -> float:
    """Return `angle` between -π and π."""
    return math.atan2(math.sin(angle), math.cos(angle))
