"""A scan that updates tracks, and tests of the scan at the present and earlier positions of a track."""

import cmath
import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from simscen.advanced.prediction.clusters import Points
from simscen.advanced.prediction.free_space_memory import SAME_DISTANCE_M, EarlierScan
from simscen.advanced.prediction.tracks import Track
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan

PointOrPoints = TypeVar("PointOrPoints", complex, Points)


class LidarPose(NamedTuple):
    """Pose of a lidar: `position` as x + iy in m, and heading as the unit vector `direction`."""

    position: complex
    direction: complex

    @classmethod
    def of(cls, pose: Pose2) -> "LidarPose":
        """Return the same pose with complex numbers."""
        return cls(complex(pose.x, pose.y), cmath.rect(1.0, pose.yaw))

    def to_parent(self, points: PointOrPoints) -> PointOrPoints:
        """Transform points from the lidar frame to the parent frame."""
        return points * self.direction + self.position

    def to_lidar(self, points: PointOrPoints) -> PointOrPoints:
        """Transform points from the parent frame to the lidar frame."""
        return (points - self.position) * self.direction.conjugate()


@dataclass(frozen=True, eq=False)
class CurrentScan:
    """A scan with the endpoints of its beams (n,) in the lidar frame, the pose of the lidar, and an earlier scan."""

    scan: Scan
    ends: Points
    lidar_pose: Pose2
    earlier: EarlierScan | None

    @cached_property
    def lidar(self) -> LidarPose:
        """The `lidar_pose` as complex numbers."""
        return LidarPose.of(self.lidar_pose)

    def sees_past(self, track: Track) -> bool:
        """Return whether the lidar sees past the predicted center of a track."""
        center = self.lidar.to_lidar(track.position)
        beam = self._beam_toward(center)
        return beam is not None and bool(self.scan.ranges[beam] > abs(center))

    def has_left(self, track: Track) -> bool:
        """Return whether at least half of the earlier positions of a track are no longer occupied.

        A position is still occupied if both this scan and the earlier scan hit something there. A false track that
        jumps from post to post does not leave its positions.
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
        """Return the endpoint of the beam toward `point`, if it is within `reach` m of `point` but not of `current`."""
        beam = self._beam_toward(point)
        end = None if beam is None else complex(self.ends[beam])
        return end if end is not None and abs(end - point) <= reach < abs(end - current) else None

    def _beam_toward(self, point: complex) -> int | None:
        """Return the index of the beam toward a point in the lidar frame; None outside the field of view."""
        scan = self.scan
        beams = (cmath.phase(point) - scan.angle_min) % math.tau / scan.angle_increment
        beam = round(beams) if beams < math.tau / scan.angle_increment - 0.5 else 0
        return beam if beam < len(scan.ranges) else None
