"""The surfaces that a scan shows: points, and which way what they are on faces."""

import cmath
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import Plane, directions, evenly

BASELINE = 0.15
"""m between the points whose line is the surface at the point amid them."""
STRAIGHT = 0.05
"""m between the point amid them and that line, at most."""
TORN = 0.5
"""m: points this far apart on both sides of one are not of one surface."""
REACH = 20.0

_NONE: Plane = np.empty(0, dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class Surface:
    """Points (n,) and the normals (n,) of the surfaces that they are on."""

    points: Plane
    normals: Plane

    def placed(self, pose: Pose2) -> "Surface":
        """The same in the parent frame of `pose`."""
        turn = cmath.rect(1.0, pose.yaw)
        return Surface(self.points * turn + complex(pose.x, pose.y), self.normals * turn)

    def thinned(self, count: int) -> "Surface":
        """At most `count` points, evenly chosen."""
        if len(self.points) <= count:
            return self
        chosen = evenly(len(self.points), count)
        return Surface(self.points.take(chosen), self.normals.take(chosen))


def surfaces_of(scan: Scan) -> Surface:
    """What a scan hit, in the base frame; points at an edge, whose surface nobody can tell, are left out."""
    ranges = scan.ranges
    hit = ((ranges > scan.range_min) & (ranges < min(scan.range_max, REACH))).nonzero()[0]
    if len(hit) < 3:
        return Surface(_NONE, _NONE)
    ranges, gap = ranges.take(hit), abs(scan.angle_increment)
    points: Plane = ranges * directions(scan).take(hit)
    apart = np.ceil((BASELINE / 2 / gap) / np.maximum(ranges, 1e-3 / gap)).astype(np.int64)
    row = np.arange(len(hit))
    before = points.take(row - apart, mode="clip")
    along = points.take(row + apart, mode="clip") - before
    length = np.abs(along)
    bent = np.abs(((points - before).conj() * along).imag)
    # What has no length is not less bent than a share of it either.
    flat = ((length < np.maximum(TORN, 4 * gap * ranges)) & (bent < STRAIGHT * length)).nonzero()[0]
    normals = along.take(flat) * -1j / length.take(flat)
    return Surface(points.take(flat) + complex(scan.mount.x, scan.mount.y), normals)
