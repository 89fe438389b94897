"""Where a robot can be: not far from where it last was sure to be, carried on by how it saw itself go."""

import math
from dataclasses import dataclass, replace

import numpy as np

from simscen.advanced.localizers.scan_matcher import Step
from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.clusters import errors_about
from simscen.stack.localizers.planar_motion import Noise, swing, turn, turned

AROUND = (0.1, 0.1, 0.05)
"""m, m, rad: standard deviations of a robot about a place where it is sure to be."""
DRIFT = (0.03, 0.01)
"""m and rad: what it may drift by for each meter, turns included, where no scan says how it went."""
LED = 0.1, 0.5
"""m, and of the way by wheels: where scans say so much less or more of a step, what they show goes along, as people do;
wheels that slip are 40 % off at most, but for those that spin on the spot, where nothing new is to be seen."""
TOLD = 0.012
"""m: by how much more than this the standard deviation of a step is larger, a robot drifts: along a corridor that looks
the same everywhere the wheels have their way, and slip for a while, so that such steps err together."""


CERTAIN: Noise = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class ObservedMotion:
    """A way from one correction to the next: a `step` as scans show it, if they do.

    What scans and wheels say of it is `torn` apart, where they do not agree: then one of them errs by as much. Wheels
    slip, or people walk along with the robot. The last scan showed hardly anything of what those before it did if they
    `parted`, None when nobody can say.
    """

    torn: Pose2 = Pose2(0.0, 0.0, 0.0)
    step: Step | None = None
    parted: bool | None = None

    @property
    def led(self) -> bool:
        """Whether scans and wheels differ by more than wheels slip."""
        apart = math.hypot(self.torn.x, self.torn.y)
        if self.step is None or apart < LED[0]:
            return False
        wheels = self.step.delta.compose(self.torn.inverse())
        return apart > LED[1] * math.hypot(wheels.x, wheels.y)

    def together(self, meters: float) -> tuple[float, float]:
        """m and rad by which this way and others like it may err in one direction."""
        if self.step is None:
            return DRIFT[0] * meters, DRIFT[1] * meters
        (xx, _, _), (_, yy, _), _ = self.step.covariance.tolist()
        untold = max(0.0, math.sqrt(max(xx, yy)) - TOLD)
        return untold + math.hypot(self.torn.x, self.torn.y), abs(self.torn.yaw)


@dataclass(frozen=True, eq=False)
class PosePrior:
    """A robot was at `pose` when its base was at `base` in a frame that drifts.

    `std` (3,) are the standard deviations of the pose in m, m and rad; `covariance` (3, 3) is that of how the robot saw
    itself go since, in the frame that drifts, and `together` in m and rad what may err in one direction besides.
    """

    pose: Pose2
    base: Pose2
    std: Array
    covariance: Array
    together: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def at(cls, pose: Array, base: Pose2, std: Array | tuple[float, float, float] = AROUND) -> "PosePrior":
        """Sure by what was seen, or by what was told if that says how much."""
        return cls(Pose2(*pose.tolist()), base, np.array(std), np.zeros((3, 3)))

    def after(self, before: Pose2, base: Pose2, meters: float, way: ObservedMotion) -> "PosePrior":
        """The same, when the base went on from `before`."""
        meter, rad = way.together(meters)
        noise = CERTAIN if way.step is None else turned(way.step.covariance, before.yaw)
        covariance = swing(self.covariance, base.x - before.x, base.y - before.y, noise)
        return replace(self, covariance=covariance, together=(self.together[0] + meter, self.together[1] + rad))

    def expected(self, base: Pose2) -> Array:
        """The pose (3,) where the robot is if it has not drifted."""
        return np.array(self.pose.compose(self.base.between(base)))

    def unlikely(self, poses: Array, base: Pose2) -> Array:
        """The logarithm of how many times unlikelier than the expected pose each of `poses` (n, 3) is: (n,)."""
        frame = turn(self.pose.yaw - self.base.yaw)
        meter, rad = self.together
        std = np.square(self.std + np.array((meter, meter, rad)))
        off = errors_about(self.expected(base), poses)
        information = np.linalg.inv(frame @ self.covariance @ frame.T + np.diag(std))
        far: Array = 0.5 * np.einsum("ni,ij,nj->n", off, information, off)
        return far
