"""Motion measured by scan matching, its agreement with odometry, and its use as motion model of particles."""

import math
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.particles import empty_poses, wrap_headings

AGREEMENT_PER_M, AGREEMENT_M = 0.1, 0.03
"""Maximum difference between the translations by odometry and by an agreeing match: per meter, and a constant."""
AGREEMENT_PER_RAD, AGREEMENT_RAD = 0.1, 0.03
"""Maximum difference between the rotations by odometry and by an agreeing match: per radian, and a constant."""


@dataclass(frozen=True, eq=False)
class MatchedMotion:
    """Motion between two scans by scan matching, in the base frame of the first scan, with its covariance (3, 3)."""

    delta: Pose2
    covariance: Array

    def agrees(self, odometry: Pose2) -> bool:
        """Return whether the motion by `odometry` is nearly the same."""
        difference = odometry.between(self.delta)
        distance, turned = math.hypot(odometry.x, odometry.y), abs(odometry.yaw)
        return (
            math.hypot(difference.x, difference.y) < AGREEMENT_M + AGREEMENT_PER_M * distance
            and abs(difference.yaw) < AGREEMENT_RAD + AGREEMENT_PER_RAD * turned
        )


def sample_motion(poses: Array, step: MatchedMotion, rng: np.random.Generator) -> Array:
    """Return `poses` (n, 3), each moved by its own random sample of a motion."""
    forward, left, turn = np.dot(_cholesky_factor(step.covariance), rng.standard_normal((3, len(poses))))
    forward += step.delta.x
    left += step.delta.y
    turn += step.delta.yaw
    x, y, heading = poses.T
    c, s = np.cos(heading), np.sin(heading)
    after = empty_poses(len(poses))
    after[:, 0] = x + c * forward - s * left
    after[:, 1] = y + s * forward + c * left
    after[:, 2] = wrap_headings(heading + turn)
    return after


def _cholesky_factor(covariance: Array) -> Array:
    """Return the Cholesky factor (3, 3), lower triangle, of a covariance."""
    (xx, _, _), (xy, yy, _), (xa, ya, aa) = covariance.tolist()
    x = math.sqrt(xx)
    y_x, a_x = xy / x, xa / x
    y = math.sqrt(yy - y_x * y_x)
    a_y = (ya - a_x * y_x) / y
    return np.array(((x, 0.0, 0.0), (y_x, y, 0.0), (a_x, a_y, math.sqrt(aa - a_x * a_x - a_y * a_y))))
