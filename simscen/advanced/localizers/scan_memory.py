"""Scans of the last meters, combined by odometry. Together, they identify a pose far better than one scan."""

import cmath
from collections import deque
from dataclasses import dataclass

import numpy as np

from simscen.advanced.localizers.global_search import MAX_RANGE_M, PASSED_SHARES, View
from simscen.core.geometry import Pose2, wrap
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import Plane, directions, evenly_spaced

MEMORY_LENGTH_M = 6.0
"""Distance driven after which scans are forgotten, because errors of the odometry have distorted them."""
BEAMS_PER_SCAN = 40
MIN_SPACING_M = 0.2
"""Minimum distance driven between two scans that are kept."""
METERS_PER_RAD = 0.5
"""Distance that a rotation counts as, because it also shows the lidar something new."""


_ALONG = np.array([[share] for share in (*PASSED_SHARES, 1.0)])


@dataclass(frozen=True, eq=False)
class _Kept:
    """A kept scan, taken at `odometry` after `driven` m, rotations included.

    `points` (m, n) are points on the paths of the n beams and, in the last row, their endpoints, in the odometry frame.
    """

    odometry: Pose2
    driven: float
    points: Plane


class ScanMemory:
    """The scans of the last MEMORY_LENGTH_M meters."""

    def __init__(self) -> None:
        self._kept: deque[_Kept] = deque()

    @property
    def length(self) -> float:
        """Distance in m between the oldest and the newest scan, rotations included."""
        return self._kept[-1].driven - self._kept[0].driven if self._kept else 0.0

    def add(self, scan: Scan, odometry: Pose2, least: float, most: float) -> Plane:
        """Add a scan, with ranges between `least` and `most`. Return its endpoints in the base frame."""
        ends = endpoints_of(scan, least, most)
        if self._kept:
            last = self._kept[-1]
            driven = last.driven + traveled(last.odometry, odometry)
            if driven - last.driven < MIN_SPACING_M:
                return ends
        else:
            driven = 0.0
        lidar = complex(scan.mount.x, scan.mount.y)
        points = (_ALONG * (ends - lidar) + lidar) * cmath.rect(1.0, odometry.yaw) + complex(odometry.x, odometry.y)
        self._kept.append(_Kept(odometry, driven, points))
        while driven - self._kept[0].driven > MEMORY_LENGTH_M:
            self._kept.popleft()
        return ends

    def forget(self, keep: int) -> None:
        """Forget all but the newest `keep` scans."""
        while len(self._kept) > keep:
            self._kept.popleft()

    def view_from(self, odometry: Pose2) -> View:
        """Return all kept points in the frame of a base at `odometry`."""
        points = np.concatenate([kept.points for kept in self._kept], axis=1)
        points -= complex(odometry.x, odometry.y)
        points *= cmath.rect(1.0, -odometry.yaw)
        return View(points[-1], points[:-1].ravel())


def traveled(before: Pose2, after: Pose2) -> float:
    """Return the distance in m between two poses, rotations included."""
    return before.distance(after) + METERS_PER_RAD * abs(wrap(after.yaw - before.yaw))


def endpoints_of(scan: Scan, least: float, most: float) -> Plane:
    """Return endpoints (n,) in the base frame of evenly spaced beams of a scan that hit something."""
    least, most = max(scan.range_min, least), min(scan.range_max, most, MAX_RANGE_M)
    hit = ((scan.ranges > least) & (scan.ranges < most)).nonzero()[0]
    if len(hit) > BEAMS_PER_SCAN:
        hit = hit.take(evenly_spaced(len(hit), BEAMS_PER_SCAN))
    ends: Plane = scan.ranges.take(hit) * directions(scan).take(hit) + complex(scan.mount.x, scan.mount.y)
    return ends
