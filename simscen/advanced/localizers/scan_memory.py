"""Memory of the scans of the last meters, combined in the drifting frame of scan matching or odometry.

`base` is always a pose of the robot's base in this frame.
"""

import cmath
import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from simscen.advanced.localizers.global_search import MAX_RANGE_M, PASSED_SHARES, View
from simscen.core.geometry import Pose2, wrap
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import ComplexPoints, directions, evenly_spaced

MEMORY_LENGTH_M = 6.0
"""Distance driven after which scans are forgotten, because the frame drifts."""
BEAMS_PER_SCAN = 40
"""Maximum number of beams of a scan that are stored."""
MIN_SPACING_M = 0.2
"""Minimum distance driven between two scans that are stored."""
METERS_PER_RAD = 0.5
"""Distance in m that `distance_driven` and `step_length` add for a rotation by 1 rad."""
_BEAM_SHARES = np.array([[share] for share in (*PASSED_SHARES, 1.0)])
"""Stored points along a beam, as shares of its length."""


@dataclass(frozen=True, eq=False)
class _StoredScan:
    """A stored scan, taken at `base` after the distance `driven` in m since the first scan.

    `points` (m, n) are points along n beams in the drifting frame. The last row contains the endpoints.
    """

    base: Pose2
    driven: float
    points: ComplexPoints


class ScanMemory:
    """The scans of the last MEMORY_LENGTH_M meters."""

    def __init__(self) -> None:
        self._scans: deque[_StoredScan] = deque()

    @property
    def length(self) -> float:
        """Distance driven in m between the oldest and the newest stored scan."""
        return self._scans[-1].driven - self._scans[0].driven if self._scans else 0.0

    def add(self, scan: Scan, base: Pose2, min_range: float, max_range: float) -> ComplexPoints:
        """Add a scan unless the last one is closer than MIN_SPACING_M. Return the endpoints (n,) in the base frame.

        Only ranges between the limits in m are used.
        """
        ends = endpoints_of(scan, min_range, max_range)
        if self._scans:
            last = self._scans[-1]
            driven = last.driven + distance_driven(last.base, base)
            if driven - last.driven < MIN_SPACING_M:
                return ends
        else:
            driven = 0.0
        lidar = complex(scan.mount.x, scan.mount.y)
        points = (_BEAM_SHARES * (ends - lidar) + lidar) * cmath.rect(1.0, base.yaw) + complex(base.x, base.y)
        self._scans.append(_StoredScan(base, driven, points))
        while driven - self._scans[0].driven > MEMORY_LENGTH_M:
            self._scans.popleft()
        return ends

    def forget(self, kept_count: int) -> None:
        """Forget all but the newest `kept_count` scans."""
        while len(self._scans) > kept_count:
            self._scans.popleft()

    def view_from(self, base: Pose2) -> View:
        """Return all stored scans in the base frame of a robot at `base`. The memory must not be empty."""
        points = np.concatenate([stored.points for stored in self._scans], axis=1)
        points -= complex(base.x, base.y)
        points *= cmath.rect(1.0, -base.yaw)
        return View(points[-1], points[:-1].ravel())


def step_length(step: Pose2) -> float:
    """Return the length of a step in m, in which a rotation by 1 rad counts as METERS_PER_RAD."""
    return math.hypot(step.x, step.y) + METERS_PER_RAD * abs(step.yaw)


def distance_driven(before: Pose2, after: Pose2) -> float:
    """Return the distance driven in m between two poses, with rotations as in `step_length`."""
    return before.distance(after) + METERS_PER_RAD * abs(wrap(after.yaw - before.yaw))


def endpoints_of(scan: Scan, min_range: float, max_range: float) -> ComplexPoints:
    """Return the endpoints (n,) in the base frame of at most BEAMS_PER_SCAN beams with ranges between the limits."""
    min_range, max_range = max(scan.range_min, min_range), min(scan.range_max, max_range, MAX_RANGE_M)
    hit = ((scan.ranges > min_range) & (scan.ranges < max_range)).nonzero()[0]
    if len(hit) > BEAMS_PER_SCAN:
        hit = hit.take(evenly_spaced(len(hit), BEAMS_PER_SCAN))
    ends: ComplexPoints = scan.ranges.take(hit) * directions(scan).take(hit) + complex(scan.mount.x, scan.mount.y)
    return ends
