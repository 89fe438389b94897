"""Prior probability of poses, with which the Relocalizer rates candidate poses.

The prior is the last certain pose, propagated by the motion that scans and wheels have measured since then.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simscen.advanced.localizers.matched_motion import MatchedMotion
from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.dead_reckoning import (
    CovarianceTriangle,
    propagate_covariance,
    rotate_covariance,
    rotation_matrix,
)
from simscen.stack.localizers.particles import pose_errors

CERTAIN_STD = (0.1, 0.1, 0.05)
"""Standard deviations (m, m, rad) of a certain pose."""
ODOMETRY_DRIFT = (0.03, 0.01)
"""Drift of odometry in m and rad per meter driven, if scan matching fails."""
MAX_SLIP_DIFFERENCE = 0.1, 0.5
"""Largest difference that wheel slip can cause between motions by scan matching and by odometry: in m, and as a share
of the motion by odometry. If both limits are exceeded, the scans show people who walk next to the robot."""
MAX_MATCHED_STEP_STD_M = 0.012
"""Maximum standard deviation of a motion that the scans determine. If the standard deviation is larger, as in a uniform
corridor, odometry determined the motion, and the excess counts as a systematic error."""
NO_NOISE: CovarianceTriangle = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Process noise of zero for `propagate_covariance`."""


@dataclass(frozen=True, eq=False)
class ObservedMotion:
    """Motion between two successive scans.

    odometry:     motion by odometry; None if unknown
    step:         motion by scan matching; None if scan matching failed
    was_carried:  whether the scans hardly overlap, because the robot was carried elsewhere; None if unknown
    """

    odometry: Pose2 | None = None
    step: MatchedMotion | None = None
    was_carried: bool | None = None

    @cached_property
    def agrees(self) -> bool:
        """Whether scan matching and odometry measured nearly the same motion."""
        return self.step is not None and self.odometry is not None and self.step.agrees(self.odometry)

    @property
    def disagreement(self) -> Pose2:
        """Motion by scan matching relative to the motion by odometry, if both are known and disagree; otherwise 0."""
        if self.step is None or self.odometry is None or self.agrees:
            return Pose2(0.0, 0.0, 0.0)
        return self.odometry.between(self.step.delta)

    @property
    def is_scene_moving(self) -> bool:
        """Whether scans and wheels differ by more than MAX_SLIP_DIFFERENCE, because the scans show moving objects."""
        if self.odometry is None:
            return False
        difference = math.hypot(self.disagreement.x, self.disagreement.y)
        driven = math.hypot(self.odometry.x, self.odometry.y)
        return difference >= MAX_SLIP_DIFFERENCE[0] and difference > MAX_SLIP_DIFFERENCE[1] * driven

    def systematic_error(self, meters: float) -> tuple[float, float]:
        """Return the systematic errors of this motion in m and rad, which can add up over many motions.

        `meters` is the distance driven, as `scan_memory.distance_driven` returns it.
        """
        if self.step is None:
            return ODOMETRY_DRIFT[0] * meters, ODOMETRY_DRIFT[1] * meters
        (xx, _, _), (_, yy, _), _ = self.step.covariance.tolist()
        excess = max(0.0, math.sqrt(max(xx, yy)) - MAX_MATCHED_STEP_STD_M)
        return excess + math.hypot(self.disagreement.x, self.disagreement.y), abs(self.disagreement.yaw)


@dataclass(frozen=True, eq=False)
class PosePrior:
    """A certain pose and the errors of the motion since then.

    pose:              certain pose in the map frame
    base:              the robot's pose at the same time in the drifting frame of scan matching or odometry
    std (3,):          standard deviations of `pose` in m, m and rad
    covariance (3, 3): covariance of the motion since then, in the drifting frame, from independent errors
    systematic_error:  sum of the systematic errors of the motion since then, in m and rad
    """

    pose: Pose2
    base: Pose2
    std: Array
    covariance: Array
    systematic_error: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def at(cls, pose: Array, base: Pose2, std: Array | tuple[float, float, float] = CERTAIN_STD) -> "PosePrior":
        """Return the prior of a `pose` (3,) that is certain now, with standard deviations `std` in m, m and rad."""
        return cls(Pose2(*pose.tolist()), base, np.array(std), np.zeros((3, 3)))

    def propagate(self, before: Pose2, base: Pose2, meters: float, motion: ObservedMotion) -> "PosePrior":
        """Return the prior after `motion` from the pose `before` to the pose `base` in the drifting frame.

        `meters` is the distance driven, as `scan_memory.distance_driven` returns it.
        """
        distance_error, angle_error = motion.systematic_error(meters)
        total_error = self.systematic_error[0] + distance_error, self.systematic_error[1] + angle_error
        noise = NO_NOISE if motion.step is None else rotate_covariance(motion.step.covariance, before.yaw)
        covariance = propagate_covariance(self.covariance, base.x - before.x, base.y - before.y, noise)
        return replace(self, covariance=covariance, systematic_error=total_error)

    def expected(self, base: Pose2) -> Array:
        """Return the pose (3,) in the map frame, without drift, of a robot at `base` in the drifting frame."""
        return np.array(self.pose.compose(self.base.between(base)))

    def negative_log_likelihood(self, poses: Array, base: Pose2) -> Array:
        """Return the negative log-likelihoods (n,) of map `poses` (n, 3) for a robot at `base` in the drifting frame.

        The value at the expected pose is 0.
        """
        frame = rotation_matrix(self.pose.yaw - self.base.yaw)
        distance_error, angle_error = self.systematic_error
        variances = np.square(self.std + np.array((distance_error, distance_error, angle_error)))
        errors = pose_errors(self.expected(base), poses)
        information = np.linalg.inv(frame @ self.covariance @ frame.T + np.diag(variances))
        negative: Array = 0.5 * np.einsum("ni,ij,nj->n", errors, information, errors)
        return negative
