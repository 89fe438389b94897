"""Covariance of a pose estimate, from the scatter of recent poses and from the residuals of scans."""

import math
from collections import deque

import numpy as np

from simscen.advanced.localizers.map_trust import ScanResiduals
from simscen.advanced.localizers.scan_matcher import COVARIANCE_FLOOR
from simscen.advanced.localizers.scan_memory import step_length
from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.stack.localizers.dead_reckoning import propagate_covariance, rotation_matrix

WINDOW_SIZE = 36
"""Number of recent corrections that are compared, about 9 m of driving."""
CORRELATION_LENGTHS_M = np.array((2.0, 2.0, 1.1))
"""Correlation length of the errors (longitudinal, lateral, yaw) in m driven, by `step_length`.

The errors of poses 4 m apart have the correlations 0.4, 0.4 and 0.1, both with correct maps and with moved furniture.
"""
DRIFT_VARIANCE = np.square((0.002, 0.002, 0.0016))
"""Variance (m², m², rad²) of the drift of scan matching per meter, where scans show walls in all directions."""
FORGETTING_FACTOR = 0.99
"""Factor on the weight of everything learned before, at each correction."""
PRIOR_RATIO, PRIOR_WEIGHT = np.array((1.7, 1.7, 1.0)), 20.0
"""Initial ratio of the true standard deviations (longitudinal, lateral, yaw) to those of the particles, if residuals
are as large as `sigma_hit`. The weight is the number of corrections that count as much as this ratio."""
EXPECTED_WEIGHT = 0.05
"""Weight of the expected ratio in `_scatter_ratio`, as a number of independent corrections. The expected ratio
dominates while the robot hardly moves, because poses close to each other share their errors."""
DEGREES_OF_FREEDOM = 6.0
"""Degrees of freedom of a covariance that is estimated from few, correlated corrections."""
ODOMETRY_STD = 0.05, 0.05
"""Prior standard deviations of odometry in m and rad per meter."""
ODOMETRY_STD_WEIGHT = 0.2
"""Weight of ODOMETRY_STD, as a sum of squared step lengths in m²: that of about three steps."""
MIN_COVARIANCE = np.diag(np.square((1e-3, 1e-3, 1e-3)))
"""Added to each covariance (m², m², rad²), so that none is singular."""


class CovarianceEstimator:
    """Scales the covariance of the particles to the real errors of the estimated pose.

    A particle filter treats the errors of all beams and scans as independent. But furniture that was moved, or a map
    that is half a cell off, shifts the pose in the same direction for as long as it is in sight, so that the
    covariance of the particles is too small. Two measurements show by which ratio, along each axis of the robot:

    - The scatter of the last WINDOW_SIZE poses. Scan matching, which does not use the map, propagates each of them to
      the present. Their differences are due to the errors of both poses, as far as these are independent, and to the
      drift of scan matching.
    - The residuals of the beams that the map explains (the variance of unit weight of a least-squares adjustment).
      They also show errors that all poses share. How residuals translate to errors of the pose is learned from the
      scatter.

    The ratio is the mean of both, divided by the share of the beams that the map explains, because some of these fit by
    chance. Because the covariance is estimated, errors have a Student's t-distribution, whose variance is greater by
    DEGREES_OF_FREEDOM / (DEGREES_OF_FREEDOM - 2). Between corrections, the covariance grows by the errors of
    odometry that scan matching has observed.
    """

    def __init__(self) -> None:
        weight = ODOMETRY_STD_WEIGHT
        self._ratio_sum, self._ratio_weight = PRIOR_RATIO * PRIOR_WEIGHT, PRIOR_WEIGHT
        self._odometry_square, self._yaw_square = ODOMETRY_STD[0] ** 2 * weight, ODOMETRY_STD[1] ** 2 * weight
        self._step_square = weight
        self.forget_poses()

    def forget_poses(self) -> None:
        """Forget the poses, after the robot was found elsewhere, but keep everything learned from them."""
        self._poses: Array = np.empty((0, 3))
        self._bases: Array = np.empty((0, 3))
        self._drifts: Array = np.empty((0, 3, 3))  # since each pose, in the frame of the bases
        self._distances, self._weights = np.empty(0), np.empty(0)
        self._residuals: deque[ScanResiduals] = deque(maxlen=WINDOW_SIZE)
        self._base: Pose2 | None = None

    def learn_odometry_error(self, matched: Pose2, odometry: Pose2) -> None:
        """Learn the error of odometry from one step, measured by scan matching and by odometry."""
        x, y, yaw = odometry.between(matched)
        self._odometry_square = max(
            0.0,
            FORGETTING_FACTOR * self._odometry_square + (x * x + y * y - COVARIANCE_FLOOR[0] - COVARIANCE_FLOOR[1]) / 2,
        )
        self._yaw_square = max(0.0, FORGETTING_FACTOR * self._yaw_square + yaw * yaw - COVARIANCE_FLOOR[2])
        self._step_square = FORGETTING_FACTOR * self._step_square + step_length(odometry) ** 2

    def propagate(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """Return the covariance (3, 3) of a pose with heading `yaw` after `delta`, measured by odometry."""
        c, s, share = math.cos(yaw), math.sin(yaw), step_length(delta) ** 2 / self._step_square
        translation_variance = self._odometry_square * share
        noise = translation_variance, 0.0, 0.0, translation_variance, 0.0, self._yaw_square * share
        return propagate_covariance(covariance, c * delta.x - s * delta.y, s * delta.x + c * delta.y, noise)

    def propagate_poses(self, base: Pose2, step_covariance: Array | None) -> None:
        """Propagate all poses to `base`, the robot's pose in the scan matcher's frame.

        `step_covariance` (3, 3) is that of the step, in the base frame before it; None if odometry measured the step.
        """
        last, self._base = self._base or base, base
        step = last.between(base)
        distance = step_length(step)
        if step_covariance is None:
            share = distance**2 / self._step_square
            step_covariance = np.diag(
                (self._odometry_square * share, self._odometry_square * share, self._yaw_square * share)
            )
        else:
            step_covariance = step_covariance - np.diag(COVARIANCE_FLOOR)  # these errors do not add up over steps
        frame = rotation_matrix(last.yaw)
        lever = np.array(((1.0, 0.0, last.y - base.y), (0.0, 1.0, base.x - last.x), (0.0, 0.0, 1.0)))
        self._drifts = (
            lever @ self._drifts @ lever.T + frame @ (step_covariance + np.diag(DRIFT_VARIANCE * distance)) @ frame.T
        )
        self._distances = self._distances + distance

    def estimate(self, pose: Pose2, covariance: Array, residuals: ScanResiduals | None) -> Array:
        """Return the covariance (3, 3) of `pose` after a correction at the base of the last `propagate_poses`.

        `covariance` is that of the particles; `residuals` are those of the scan, None if the map explains nothing.
        """
        own = covariance + MIN_COVARIANCE
        self._add(pose, 1.0 / float(own[0, 0] + own[1, 1]))
        if residuals is not None:
            self._residuals.append(residuals)
        explained, residual = self._mean_residuals()
        axes = rotation_matrix(pose.yaw).T
        rotated = axes @ own @ axes.T
        learned = self._ratio_sum / self._ratio_weight
        scatter = self._scatter_ratio(np.diag(rotated), np.square(learned * residual))
        self._ratio_sum = FORGETTING_FACTOR * self._ratio_sum + scatter / residual
        self._ratio_weight = FORGETTING_FACTOR * self._ratio_weight + 1.0
        expected = residual * self._ratio_sum / self._ratio_weight
        student = math.sqrt(DEGREES_OF_FREEDOM / (DEGREES_OF_FREEDOM - 2.0))
        ratio = (scatter + expected) / 2.0 / explained * student
        scaled: Array = axes.T @ (rotated * np.outer(ratio, ratio)) @ axes
        return scaled

    def _add(self, pose: Pose2, weight: float) -> None:
        """Add a pose; `weight` in 1/m² is the inverse variance of its particles."""
        assert self._base is not None  # `propagate_poses` precedes every correction
        recent = slice(1 - WINDOW_SIZE, None)
        self._poses = np.vstack((self._poses[recent], pose))
        self._bases = np.vstack((self._bases[recent], self._base))
        self._drifts = np.concatenate((self._drifts[recent], np.zeros((1, 3, 3))))
        self._distances = np.append(self._distances[recent], 0.0)
        self._weights = np.append(self._weights[recent], weight)

    def _mean_residuals(self) -> tuple[float, float]:
        """Return the share of explained beams in the last scans, and the RMS of their residuals in `sigma_hit`."""
        if not self._residuals:
            return 1.0, 1.0
        explained, square = (sum(values) / len(self._residuals) for values in zip(*self._residuals, strict=True))
        return explained, math.sqrt(max(square / explained, 1e-3))

    def _scatter_ratio(self, own: Array, expected: Array) -> Array:
        """Return the ratio (3,) of the poses' scatter to their own standard deviations (longitudinal, lateral, yaw).

        `own` (3,) are the variances of the particles. The difference of a pose from the newest pose has less weight if
        more of it is drift. `expected` (3,) are the squared ratios to assume without poses.
        """
        x, y, yaw = self._poses[-1]
        rotations = self._poses[:, 2] - self._bases[:, 2]
        driven = np.exp(1j * rotations) * ((self._bases[-1] - self._bases)[:, :2] @ (1.0, 1j))
        offsets = (self._poses[:, :2] @ (1.0, 1j) + driven - complex(x, y)) * np.exp(-1j * yaw)
        errors = np.column_stack((offsets.real, offsets.imag, wrap_array(rotations - rotations[-1])))
        c, s = math.cos(self._bases[-1, 2]), math.sin(self._bases[-1, 2])
        (xx, xy, _), (_, yy, _), (_, _, aa) = self._drifts.transpose(1, 2, 0)
        drift = np.column_stack(
            (c * c * xx + 2 * c * s * xy + s * s * yy, s * s * xx - 2 * c * s * xy + c * c * yy, aa)
        )
        weights = np.square(own / (own + drift)) * (self._weights / self._weights.sum())[:, np.newaxis]
        lengths = self._distances[:, np.newaxis] / CORRELATION_LENGTHS_M
        independent = 2.0 * (1.0 - (1.0 + lengths) * np.exp(-lengths))  # by Matérn's correlation of smooth errors
        squares = (weights * np.square(errors)).sum(axis=0) / own + EXPECTED_WEIGHT * expected
        ratio: Array = np.sqrt(squares / ((weights * independent).sum(axis=0) + EXPECTED_WEIGHT))
        return ratio
