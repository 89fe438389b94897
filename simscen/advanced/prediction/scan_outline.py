"""A scan with the pose of its lidar, which determines which positions of tracks are visible."""

import cmath
import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from simscen.advanced.prediction.clusters import Points
from simscen.advanced.prediction.tracks import Track
from simscen.advanced.prediction.visibility import SAME_DISTANCE_M, EarlierScan
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan

PointOrPoints = TypeVar("PointOrPoints", complex, Points)


class LidarPose(NamedTuple):
    """Pose of a lidar: `position` as x + iy in m, and heading as the unit vector `direction`."""

    position: complex
    direction: complex

    @classmethod
    def of(cls, pose: Pose2) -> "LidarPose":
        """Return the lidar pose for a pose of the plane."""
        return cls(complex(pose.x, pose.y), cmath.rect(1.0, pose.yaw))

    def to_parent(self, points: PointOrPoints) -> PointOrPoints:
        """Transform points from the lidar frame to the parent frame."""
        return points * self.direction + self.position

    def to_lidar(self, points: PointOrPoints) -> PointOrPoints:
        """Transform points from the parent frame to the lidar frame."""
        return (points - self.position) * self.direction.conjugate()


@dataclass(frozen=True, eq=False)
class CurrentScan:
    """A scan with its beam ends (n,) in the lidar frame, the pose of the lidar, and an earlier scan."""

    scan: Scan
    ends: Points
    lidar_pose: Pose2
    earlier: EarlierScan | None

    @cached_property
    def lidar(self) -> LidarPose:
        """Pose of the lidar."""
        return LidarPose.of(self.lidar_pose)

    def sees_past(self, track: Track) -> bool:
        """Return whether the lidar sees past the predicted center of a track."""
        off = self.lidar.to_lidar(track.position)
        beam = self._beam_toward(off)
        return beam is not None and bool(self.scan.ranges[beam] > abs(off))

    def has_left(self, track: Track) -> bool:
        """Return whether a track has left its earlier positions: nothing there now was also hit by an earlier scan.

        A false track that jumps between posts leaves the posts behind. Up to half of the positions may be occupied,
        because another obstacle can follow the same path.
        """
        current, radius = self.lidar.to_lidar(track.position), track.radius
        positions = [update.position for update in track.updates if abs(update.position - track.position) > radius]
        hits = [
            end
            for each in positions
            if (end := self._hit_near(self.lidar.to_lidar(each), current, radius + SAME_DISTANCE_M)) is not None
        ]
        if 2 * len(hits) <= len(positions) or self.earlier is None:
            return True
        was_occupied = self.earlier.compare(np.array(hits), self.lidar_pose).was_occupied()
        return 2 * int(np.count_nonzero(was_occupied)) <= len(positions)

    def _hit_near(self, point: complex, current: complex, reach: float) -> complex | None:
        """Return the hit of the beam toward a point if it is within `reach` of it and not on the track at `current`."""
        beam = self._beam_toward(point)
        end = None if beam is None else complex(self.ends[beam])
        return end if end is not None and abs(end - point) <= reach < abs(end - current) else None

    def _beam_toward(self, point: complex) -> int | None:
        scan = self.scan
        beam = round((cmath.phase(point) - scan.angle_min) % (2 * math.pi) / scan.angle_increment)
        return beam if beam < len(scan.ranges) else None
