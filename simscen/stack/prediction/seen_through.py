"""Free space, remembered as earlier scans: what stands now where one of them saw through has come there.

A wall of which more is seen from another place, and the edge of what is half hidden, were never seen through. So
neither turning nor driving makes static things move, and what drift of the odometry does in the time that is
remembered is less than the margin.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.sensing import Scan

MARGIN, RELATIVE = 0.25, 0.02
"""Metres, and share of the range, by which an earlier beam must have gone farther."""
AGO, AT_LEAST = 1.0, 0.2
"""Seconds: the age of the scan that is asked, and while none is so old the least. At 0.25 m/s a thing near by comes
as far as the margin in that time."""
FEWEST_BEAMS = 3
"""Of a scan that can tell."""
TURNED = 0.02
"""rad: what beams beside a point must have gone farther, too: headings that are a second apart are wrong by some of it,
and at an edge it is chance which beam hits."""
KEPT = 64
"""Scans at most."""


@dataclass(frozen=True, eq=False)
class Earlier:
    """A scan, where its lidar was in the odom frame, and how far (n,) its beams saw."""

    tick: int
    lidar: Pose2
    lengths: Array
    angle_min: float
    angle_increment: float


class SeenThrough:
    """The newest scans of one lidar."""

    def __init__(self, tick_rate: int) -> None:
        self._ago, self._at_least = round(AGO * tick_rate), round(AT_LEAST * tick_rate)
        self._scans: deque[Earlier] = deque(maxlen=KEPT)

    def remember(self, scan: Scan, lidar: Pose2) -> None:
        """Keep a scan; `lidar` is where it was taken."""
        if len(scan.ranges) < FEWEST_BEAMS or scan.angle_increment <= 0.0:
            return
        while len(self._scans) > 1 and self._scans[1].tick <= scan.tick - self._ago:
            self._scans.popleft()
        self._scans.append(Earlier(scan.tick, lidar, _lengths(scan), scan.angle_min, scan.angle_increment))

    def appeared(self, tick: int, points: Array) -> npt.NDArray[np.bool_]:
        """Which of the points (n, 2) in the odom frame were free about AGO before `tick`."""
        while len(self._scans) > 1 and self._scans[1].tick <= tick - self._ago:
            self._scans.popleft()
        if not self._scans or self._scans[0].tick > tick - self._at_least:
            return np.zeros(len(points), dtype=bool)
        old = self._scans[0]
        dx, dy = points[:, 0] - old.lidar.x, points[:, 1] - old.lidar.y
        distance = np.hypot(dx, dy)
        bearing = np.arctan2(dy, dx)
        bearing -= old.lidar.yaw + old.angle_min
        beam = np.rint((bearing % (2 * math.pi)) / old.angle_increment).astype(np.int64)
        count, beside = len(old.lengths), max(1, math.ceil(TURNED / old.angle_increment))
        beams = beam[:, None] + np.arange(-beside, beside + 1)
        if count * old.angle_increment > 2 * math.pi - 1.5 * old.angle_increment:
            beams %= count
        inside = (beams >= 0) & (beams < count)
        least = np.where(inside, old.lengths[np.where(inside, beams, 0)], 0.0).min(axis=1)
        return np.asarray(least > distance * (1.0 + RELATIVE) + MARGIN)


def _lengths(scan: Scan) -> Array:
    """How far each beam saw; one without an answer saw nothing."""
    with np.errstate(invalid="ignore"):
        lengths: Array = np.where(scan.ranges >= scan.range_min, scan.ranges, 0.0)
    return lengths
