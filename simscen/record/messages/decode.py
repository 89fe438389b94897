"""Reads those messages of a log that a Trace is made of, with every number as it was written."""

from typing import NamedTuple

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.record.messages.cdr import CdrReader
from simscen.record.simtime import Stamp

Numbers = tuple[float, ...]

_UPPER_TRIANGLE = (0, 1, 5, 7, 11, 35)
_ON_THE_GROUND = (0, 1, 5)


class Transform(NamedTuple):
    """One link of a TFMessage; `pose` is x, y, z and a quaternion."""

    frame: str
    child: str
    pose: Numbers


def odometry(data: bytes) -> tuple[Numbers, Numbers]:
    """Pose and vx, vy, wz of a nav_msgs/msg/Odometry."""
    cursor = _after_header(data)
    cursor.string()
    pose = cursor.take("7d")
    cursor.take("36d")
    twist = cursor.take("6d")
    return pose, tuple(twist[i] for i in _ON_THE_GROUND)


def pose_with_covariance(data: bytes) -> tuple[Numbers, Numbers]:
    """Pose and xx, xy, xyaw, yy, yyaw, yawyaw of a geometry_msgs/msg/PoseWithCovarianceStamped."""
    cursor = _after_header(data)
    pose, covariance = cursor.take("7d"), cursor.take("36d")
    return pose, tuple(covariance[i] for i in _UPPER_TRIANGLE)


def twist(data: bytes) -> Numbers:
    """vx, vy, wz of a geometry_msgs/msg/Twist."""
    values = CdrReader(data).take("6d")
    return tuple(values[i] for i in _ON_THE_GROUND)


def float64(data: bytes) -> Numbers:
    """The number of a std_msgs/msg/Float64."""
    return CdrReader(data).take("d")


def string(data: bytes) -> str:
    """The text of a std_msgs/msg/String."""
    return CdrReader(data).string()


def transforms(data: bytes) -> list[Transform]:
    """The links of a tf2_msgs/msg/TFMessage."""
    cursor = CdrReader(data)
    links = []
    for _ in range(cursor.count()):
        cursor.take("iI")
        links.append(Transform(cursor.string(), cursor.string(), cursor.take("7d")))
    return links


def path(data: bytes) -> tuple[Stamp, Array]:
    """When a nav_msgs/msg/Path was made, and its poses (n, 7)."""
    cursor = CdrReader(data)
    sec, nanosec = cursor.take("iI")
    cursor.string()
    poses = np.empty((cursor.count(), 7))
    for row in poses:
        cursor.take("iI")
        cursor.string()
        row[:] = cursor.take("7d")
    return (int(sec), int(nanosec)), poses


def occupancy_grid(data: bytes, resolution: float, origin: Pose2) -> OccupancyGrid:
    """The cells of a nav_msgs/msg/OccupancyGrid, whose own resolution is rounded to a float32."""
    cursor = _after_header(data)
    cursor.take("iI")
    cursor.take("f")
    width, height = (int(n) for n in cursor.take("2I"))
    cursor.take("7d")
    cursor.count()
    cells = cursor.array("i1", (height, width)).astype(np.int8)
    return OccupancyGrid(cells, resolution, origin)


def _after_header(data: bytes) -> CdrReader:
    cursor = CdrReader(data)
    cursor.take("iI")
    cursor.string()
    return cursor
