"""Surface points of a scan with their normals, for scan matching."""

import cmath
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import Plane, directions, evenly_spaced

BASELINE_M = 0.15
"""Distance between the two points whose line gives the normal of the point between them."""
MAX_BEND_RATIO = 0.05
"""Maximum distance of the point from this line, as a ratio of its length."""
MAX_LINE_M = 0.5
"""Maximum length of this line. Points farther apart are not on the same surface."""
MAX_RANGE_M = 20.0

_NONE: Plane = np.empty(0, dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class Surface:
    """Points (n,) and the normals (n,) of their surfaces, as complex numbers."""

    points: Plane
    normals: Plane

    def placed(self, pose: Pose2) -> "Surface":
        """Return the surface in the parent frame of `pose`."""
        turn = cmath.rect(1.0, pose.yaw)
        return Surface(self.points * turn + complex(pose.x, pose.y), self.normals * turn)

    def thinned(self, count: int) -> "Surface":
        """Return at most `count` points, evenly spaced."""
        if len(self.points) <= count:
            return self
        chosen = evenly_spaced(len(self.points), count)
        return Surface(self.points.take(chosen), self.normals.take(chosen))


def surfaces_of(scan: Scan) -> Surface:
    """Return the surface that a scan hit, in the base frame, without points at edges, whose normal is unknown."""
    ranges = scan.ranges
    hit = ((ranges > scan.range_min) & (ranges < min(scan.range_max, MAX_RANGE_M))).nonzero()[0]
    if len(hit) < 3:
        return Surface(_NONE, _NONE)
    ranges, gap = ranges.take(hit), abs(scan.angle_increment)
    points: Plane = ranges * directions(scan).take(hit)
    apart = np.ceil((BASELINE_M / 2 / gap) / np.maximum(ranges, 1e-3 / gap)).astype(np.int64)
    row = np.arange(len(hit))
    before = points.take(row - apart, mode="clip")
    along = points.take(row + apart, mode="clip") - before
    length = np.abs(along)
    bent = np.abs(((points - before).conj() * along).imag)
    # A line of length 0 fails the second comparison.
    flat = ((length < np.maximum(MAX_LINE_M, 4 * gap * ranges)) & (bent < MAX_BEND_RATIO * length)).nonzero()[0]
    normals = along.take(flat) * -1j / length.take(flat)
    return Surface(points.take(flat) + complex(scan.mount.x, scan.mount.y), normals)
