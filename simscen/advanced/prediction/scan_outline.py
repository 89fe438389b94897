"""Where a lidar is, for points as complex numbers."""

import cmath
import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from simscen.advanced.prediction.clusters import Places
from simscen.advanced.prediction.track import Track
from simscen.advanced.prediction.visibility import SAME, Earlier
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan

Spot = TypeVar("Spot", complex, Places)


class LidarPose(NamedTuple):
    """A frame in another: `at` x + iy in m, and looking along the unit vector `towards`."""

    at: complex
    towards: complex

    @classmethod
    def of(cls, pose: Pose2) -> "LidarPose":
        """That of a pose."""
        return cls(complex(pose.x, pose.y), cmath.rect(1.0, pose.yaw))

    def out(self, points: Spot) -> Spot:
        """Points of this frame as the other has them."""
        return points * self.towards + self.at

    def into(self, points: Spot) -> Spot:
        """Points of the other frame as this one has them."""
        return (points - self.at) * self.towards.conjugate()


@dataclass(frozen=True, eq=False)
class Sight:
    """A scan whose beams end at `ends` (n,) as its lidar sees them, which is `at` a pose in the frame of the tracks.

    `before` is what an earlier one saw.
    """

    scan: Scan
    ends: Places
    at: Pose2
    before: Earlier | None

    @cached_property
    def lidar(self) -> LidarPose:
        """Where the lidar is."""
        return LidarPose.of(self.at)

    def past(self, track: Track) -> bool:
        """Whether the lidar sees past the place where the middle of a track should be."""
        off = self.lidar.into(track.place)
        beam = self._towards(off)
        return beam is not None and bool(self.scan.ranges[beam] > abs(off))

    def left(self, track: Track) -> bool:
        """Whether a track has left where it was: there nothing stands now that an earlier scan hit, too.

        Of one that hops from post to post, the posts stay. Of all its places at most half may look like that: another
        thing may be where it was, as of those who go behind one another.
        """
        here, radius = self.lidar.into(track.place), track.radius
        places = [update.place for update in track.lately if abs(update.place - track.place) > radius]
        hits = [end for each in places if (end := self._beside(self.lidar.into(each), here, radius + SAME)) is not None]
        if 2 * len(hits) <= len(places) or self.before is None:
            return True
        stood = self.before.looked(np.array(hits), self.at).stood()
        return 2 * int(np.count_nonzero(stood)) <= len(places)

    def _beside(self, place: complex, here: complex, reach: float) -> complex | None:
        """What the beam towards a place hits, if that is so near to it, and not what is `here`."""
        beam = self._towards(place)
        end = None if beam is None else complex(self.ends[beam])
        return end if end is not None and abs(end - place) <= reach < abs(end - here) else None

    def _towards(self, place: complex) -> int | None:
        scan = self.scan
        beam = round((cmath.phase(place) - scan.angle_min) % (2 * math.pi) / scan.angle_increment)
        return beam if beam < len(scan.ranges) else None
