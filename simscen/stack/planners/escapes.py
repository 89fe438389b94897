"""Ways out for a hull that touches something where it stands: straight on and on arcs, as its base can drive."""

import math
from collections.abc import Iterator

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.stack.planners.endpoints import ESCAPE
from simscen.stack.planners.pose_search import SPACING, Space

DIRECTIONS = 16
"""A base that drives in any direction is tried in so many."""
CURVATURES = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Of a car's arcs, as shares of the tightest."""


def escapes(space: Space, turning_radius: float, start: Pose2) -> Iterator[Array]:
    """Poses (n, 3) of each way out, from the start on, `SPACING` apart and `ESCAPE` long; "dubins" only forward."""
    along = np.linspace(0.0, ESCAPE, round(ESCAPE / SPACING) + 1)
    if space == "se2":
        for heading in np.arange(DIRECTIONS) * (2.0 * math.pi / DIRECTIONS):
            yield _arc(start, along, 0.0, float(heading))
        return
    for signed in (along,) if space == "dubins" else (along, -along):
        for share in CURVATURES:
            yield _arc(start, signed, share / turning_radius, 0.0)


def _arc(start: Pose2, along: Array, curvature: float, heading: float) -> Array:
    """Poses so many meters along an arc that begins at `heading` to the base's own."""
    turned = curvature * along
    chord = along * np.sinc(turned / (2.0 * math.pi))
    towards = start.yaw + heading + 0.5 * turned
    yaw = np.remainder(start.yaw + turned + math.pi, 2.0 * math.pi) - math.pi
    yaw[0] = start.yaw
    return np.column_stack((start.x + chord * np.cos(towards), start.y + chord * np.sin(towards), yaw))
