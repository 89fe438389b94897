"""ROS 2 messages that are written a few times a second at most."""

import numpy as np
import numpy.typing as npt

from simscen.record.cdr import Template
from simscen.record.simtime import Stamp


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
