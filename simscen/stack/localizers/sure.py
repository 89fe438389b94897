"""Where a robot can be: not far from where it last was sure to be, carried on by how it saw itself go."""

import math
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.clusters import errors_about

AROUND = (0.1, 0.1, 0.05)
"""m, m, rad: standard deviations of a robot about a place where it is sure to be."""
DRIFT = (0.03, 0.03, 0.01)
"""What it may drift by for each metre, turns included: more than scans do that are matched with each other, for along
a corridor that looks the same everywhere the wheels have their way, and slip. Where scans and wheels do not agree, one
of them errs by as much as they differ: wheels slip, or people walk along with the robot."""


@dataclass(frozen=True, eq=False)
class Sure:
    """A robot was at `pose` when its base was at `base` in a frame that drifts, by up to `drift` (3,) until then.

    `std` (3,) are the standard deviations of the pose in m, m and rad.
    """

    pose: Pose2
    base: Pose2
    drift: Array
    std: Array

    @classmethod
    def at(cls, pose: Array, base: Pose2, drift: Array) -> "Sure":
        """Sure by what was seen."""
        return cls(Pose2(*pose.tolist()), base, drift, np.array(AROUND))

    def expected(self, base: Pose2) -> Array:
        """The pose (3,) where the robot is if it has not drifted."""
        return np.array(self.pose.compose(self.base.between(base)))

    def unlikely(self, poses: Array, base: Pose2, drift: Array) -> Array:
        """The logarithm of how many times unlikelier than the expected pose each of `poses` (n, 3) is: (n,)."""
        std = self.std + drift - self.drift
        far: Array = 0.5 * np.square(errors_about(self.expected(base), poses) / std).sum(axis=1)
        return far


def drifted(metres: float, torn: Pose2) -> Array:
    """What a robot may drift by (3,) on so many metres, turns included, of which scans and wheels differ by `torn`."""
    apart = math.hypot(torn.x, torn.y)
    drift: Array = np.array(DRIFT) * metres + (apart, apart, abs(torn.yaw))
    return drift
