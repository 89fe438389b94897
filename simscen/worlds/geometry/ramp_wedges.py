"""Ramps: wedges that rise from the ground along a line."""

import math

import numpy as np

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Mesh, Solid

Point = tuple[float, float]

_WEDGE = np.array(
    [[0, 1, 3], [0, 3, 2], [0, 4, 5], [0, 5, 1], [2, 3, 5], [2, 5, 4], [0, 2, 4], [1, 5, 3]], dtype=np.int32
)
"""Anticlockwise from outside: underside, slope, upper end, right, left."""


def wedge(start: Point, end: Point, width: float, height: float, name: str, friction: float = 1.0) -> Solid:
    """A ramp whose middle line rises from the ground at `start` to `height` meters at `end`, where it ends upright.

    Corners 0, 1 are the right and left end of its foot, 2, 3 those below its upper edge, 4, 5 … of that edge.
    """
    length, half = math.dist(start, end), width / 2
    corners = np.array(
        [[0, -half, 0], [0, half, 0], [length, -half, 0], [length, half, 0], [length, -half, height],
         [length, half, height]]
    )  # fmt: skip
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    return Solid(Mesh(corners, _WEDGE), Pose3.planar(Pose2(*start, yaw)), name, friction)
