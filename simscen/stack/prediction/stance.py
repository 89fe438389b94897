"""Where a lidar is, for points as complex numbers."""

import cmath
from typing import NamedTuple, TypeVar

from simscen.core.geometry import Pose2
from simscen.stack.prediction.clusters import Places

Spot = TypeVar("Spot", complex, Places)


class Stance(NamedTuple):
    """A frame in another: `at` x + iy in m, and looking along the unit vector `towards`."""

    at: complex
    towards: complex

    @classmethod
    def of(cls, pose: Pose2) -> "Stance":
        """That of a pose."""
        return cls(complex(pose.x, pose.y), cmath.rect(1.0, pose.yaw))

    def out(self, points: Spot) -> Spot:
        """Points of this frame as the other has them."""
        return points * self.towards + self.at

    def into(self, points: Spot) -> Spot:
        """Points of the other frame as this one has them."""
        return (points - self.at) * self.towards.conjugate()
