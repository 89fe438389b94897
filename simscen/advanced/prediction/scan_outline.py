"""A scan with the pose of its lidar, for questions about the visibility of tracks."""

import cmath
import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from simscen.advanced.prediction.clusters import Places
from simscen.advanced.prediction.tracks import Track
from simscen.advanced.prediction.visibility import SAME, EarlierScan
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan

Spot = TypeVar("Spot", complex, Places)


class LidarPose(NamedTuple):
    """Pose of a lidar: position `at` as x + iy in m, and heading as the unit vector `towards`."""

    at: complex
    towards: complex

    @classmethod
    def of(cls, pose: Pose2) -> "LidarPose":
        """Convert a pose."""
        return cls(complex(pose.x, pose.y), cmath.rect(1.0, pose.yaw))

    def out(self, points: Spot) -> Spot:
        """Transform points from the lidar frame to the parent frame."""
        return points * self.towards + self.at

    def into(self, points: Spot) -> Spot:
        """Transform points from the parent frame to the lidar frame."""
        return (points - self.at) * self.towards.conjugate()


@dataclass(frozen=True, eq=False)
class CurrentScan:
    """A scan with its beam ends (n,) in the lidar frame, the pose `at` of the lidar, and an earlier scan `before`."""

    scan: Scan
    ends: Places
    at: Pose2
    before: EarlierScan | None

    @cached_property
    def lidar(self) -> LidarPose:
        """Pose of the lidar."""
        return LidarPose.of(self.at)

    def past(self, track: Track) -> bool:
        """Return whether the lidar sees past the predicted center of a track."""
        off = self.lidar.into(track.place)
        beam = self._towards(off)
        return beam is not None and bool(self.scan.ranges[beam] > abs(off))

    def left(self, track: Track) -> bool:
        """Return whether a track has left its earlier positions: nothing there now was also hit by an earlier scan.

        A false track that jumps between posts leaves the posts behind. Up to half of the positions may be occupied,
        because another obstacle can follow the same path.
        """
        here, radius = self.lidar.into(track.place), track.radius
        places = [update.place for update in track.lately if abs(update.place - track.place) > radius]
        hits = [end for each in places if (end := self._beside(self.lidar.into(each), here, radius + SAME)) is not None]
        if 2 * len(hits) <= len(places) or self.before is None:
            return True
        stood = self.before.looked(np.array(hits), self.at).stood()
        return 2 * int(np.count_nonzero(stood)) <= len(places)

    def _beside(self, place: complex, here: complex, reach: float) -> complex | None:
        """Return the hit of the beam toward a place if it is within `reach` of it and not part of what is `here`."""
        beam = self._towards(place)
        end = None if beam is None else complex(self.ends[beam])
        return end if end is not None and abs(end - place) <= reach < abs(end - here) else None

    def _towards(self, place: complex) -> int | None:
        scan = self.scan
        beam = round((cmath.phase(place) - scan.angle_min) % (2 * math.pi) / scan.angle_increment)
        return beam if beam < len(scan.ranges) else None
