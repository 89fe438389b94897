"""What was seen on the last few meters, put together by odometry: far more telling than one scan."""

import cmath
from collections import deque
from dataclasses import dataclass

import numpy as np

from simscen.advanced.localizers.global_search import REACH, SHARES, View
from simscen.core.geometry import Pose2, wrap
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import Plane, directions, evenly

REMEMBERED = 6.0
"""m driven: what is older is forgotten, for by then raw odometry bends it."""
EACH = 40
"""Beams kept of a scan."""
APART = 0.2
"""m driven between two scans that are kept."""
METERS_A_RAD = 0.5
"""What a turn counts as: it shows a lidar something new, too."""


_ALONG = np.array([[share] for share in (*SHARES, 1.0)])


@dataclass(frozen=True, eq=False)
class _Kept:
    """What beams `saw`, after `driven` m, turns included: (m, n), points that they passed, and last of all their ends.

    In the frame that drifts, in which the base was at `odometry`: so that all are seen from anywhere at once.
    """

    odometry: Pose2
    driven: float
    saw: Plane


class ScanMemory:
    """The scans of the last REMEMBERED meters."""

    def __init__(self) -> None:
        self._kept: deque[_Kept] = deque()

    @property
    def length(self) -> float:
        """Meters driven between the oldest and the newest scan, turns included."""
        return self._kept[-1].driven - self._kept[0].driven if self._kept else 0.0

    def add(self, scan: Scan, odometry: Pose2, least: float, most: float) -> Plane:
        """Take in a scan of which ranges between `least` and `most` count; and its ends alone, about the base."""
        ends = ends_of(scan, least, most)
        if self._kept:
            last = self._kept[-1]
            driven = last.driven + travelled(last.odometry, odometry)
            if driven - last.driven < APART:
                return ends
        else:
            driven = 0.0
        lidar = complex(scan.mount.x, scan.mount.y)
        saw = (_ALONG * (ends - lidar) + lidar) * cmath.rect(1.0, odometry.yaw) + complex(odometry.x, odometry.y)
        self._kept.append(_Kept(odometry, driven, saw))
        while driven - self._kept[0].driven > REMEMBERED:
            self._kept.popleft()
        return ends

    def forget(self, but: int) -> None:
        """Keep the newest scans only."""
        while len(self._kept) > but:
            self._kept.popleft()

    def about(self, odometry: Pose2) -> View:
        """All that was seen, about a base at `odometry`."""
        saw = np.concatenate([one.saw for one in self._kept], axis=1)
        saw -= complex(odometry.x, odometry.y)
        saw *= cmath.rect(1.0, -odometry.yaw)
        return View(saw[-1], saw[:-1].ravel())


def travelled(before: Pose2, after: Pose2) -> float:
    """Meters between two poses, turns included."""
    return before.distance(after) + METERS_A_RAD * abs(wrap(after.yaw - before.yaw))


def ends_of(scan: Scan, least: float, most: float) -> Plane:
    """Where some beams of a scan, evenly chosen among those that hit something, ended: (n,), about the base."""
    least, most = max(scan.range_min, least), min(scan.range_max, most, REACH)
    hit = ((scan.ranges > least) & (scan.ranges < most)).nonzero()[0]
    if len(hit) > EACH:
        hit = hit.take(evenly(len(hit), EACH))
    ends: Plane = scan.ranges.take(hit) * directions(scan).take(hit) + complex(scan.mount.x, scan.mount.y)
    return ends
