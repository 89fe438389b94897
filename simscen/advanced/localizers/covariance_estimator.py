"""Covariance of a pose estimate, from the scatter of recent poses and the residuals of scans.

A correction is an update of the estimated pose by comparing a scan with the map.
"""

import math
import sys
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.advanced.localizers.scan_matcher import COVARIANCE_FLOOR
from simscen.advanced.localizers.scan_memory import step_length
from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.dead_reckoning import propagate_covariance, rotation_matrix
from simscen.stack.localizers.distance_field import DistanceField


class ScanResiduals(NamedTuple):
    """Residuals of the beams of one scan that end on the mapped area.

    explained:    share of these beams that the map explains
    mean_square:  mean square of the distances of the endpoints from obstacles, in units of `sigma_hit`². Each distance
                  is multiplied by the probability that the map explains the beam.
    """

    explained: float
    mean_square: float


@dataclass(frozen=True, eq=False)
class MapResiduals:
    """Computes how well the map explains scans.

    The map explains a beam with the probability hit / (hit + random). Both are terms of AMCL's likelihood of a beam,
    weighted by `z_hit` and `z_rand`. Residuals are multiplied by this probability, so that people, who are not on the
    map, do not increase them. `unmapped` marks cells of `field.table` outside the mapped area.
    """

    field: DistanceField
    unmapped: npt.NDArray[np.bool_]
    z_hit: float
    z_rand: float
    sigma_hit: float

    def residuals(self, beams: Beams, pose: Pose2) -> ScanResiduals | None:
        """Return the residuals of a scan taken at `pose`; None if the map explains none of its beams."""
        cells = self.field.endpoint_cells(np.array([pose]), beams.ends)[0]
        is_mapped = ~self.unmapped.take(cells, mode="clip")
        distances = self.field.table.take(cells, mode="clip")[is_mapped] / self.sigma_hit
        hit = self.z_hit * np.exp(-0.5 * np.square(distances, dtype=np.float64))
        if not len(hit) or not hit.any():
            return None
        # Without random measurements, both terms are 0 far from all obstacles; the map does not explain such a beam.
        explained = hit / (hit + max(self.z_rand / beams.range_max, sys.float_info.min))
        return ScanResiduals(float(explained.mean()), float(np.mean(np.square(explained * distances))))


WINDOW_SIZE = 36
"""Number of recent corrections whose poses are compared, about 9 m of driving."""
CORRELATION_LENGTHS_M = np.array((2.0, 2.0, 1.1))
"""Correlation lengths of the errors (longitudinal, lateral, yaw) in m driven, with rotations as in `step_length`."""
DRIFT_VARIANCE_PER_M = np.square((0.002, 0.002, 0.0016))
"""Variance (m², m², rad²) of the drift of scan matching per meter, where scans show walls in all directions."""
FORGETTING_FACTOR = 0.99
"""Factor on the weight of a learned value at each update of the value."""
PRIOR_RATIO, PRIOR_WEIGHT = np.array((1.7, 1.7, 1.0)), 20.0
"""Initial ratio of the true errors (longitudinal, lateral, yaw) to the standard deviations of the particles, if the RMS
of the residuals is `sigma_hit`, and weight of this ratio as a number of corrections."""
EXPECTED_WEIGHT = 0.05
"""Weight of the expected ratio in `_scatter_ratio`, as a number of independent corrections."""
DEGREES_OF_FREEDOM = 6.0
"""Degrees of freedom of a covariance that is estimated from few, correlated corrections."""
ODOMETRY_STD = 0.05, 0.05
"""Standard deviations of odometry that are assumed at first, in m and rad per meter."""
ODOMETRY_STD_WEIGHT = 0.2
"""Weight of ODOMETRY_STD, as a sum of squared step lengths in m². It is the weight of about three steps."""
MIN_COVARIANCE = np.diag(np.square((1e-3, 1e-3, 1e-3)))
"""Covariance (m², m², rad²) that is added to each covariance, so that none is singular."""


class CovarianceEstimator:
    """Scales the covariance of the particles to the real errors of the estimated pose.

    A particle filter treats the errors of successive scans as independent. Moved furniture causes equal errors in many
    scans, so that the covariance of the particles is too small. The ratio of real errors to the standard deviations of
    the particles is measured in two ways:

    - The scatter of the last WINDOW_SIZE poses, which scan matching without the map propagates to the present.
    - The residuals of the beams that the map explains. The ratio of pose errors to residuals is learned from the
      scatter.

    The mean of both ratios is divided by the share of the beams that the map explains. The result is only an estimate,
    so it is multiplied by the standard deviation of Student's t-distribution with DEGREES_OF_FREEDOM. Between
    corrections, the covariance grows by the errors of odometry that scan matching has observed.
    """

    def __init__(self) -> None:
        weight = ODOMETRY_STD_WEIGHT
        self._ratio_sum, self._ratio_weight = PRIOR_RATIO * PRIOR_WEIGHT, PRIOR_WEIGHT
        """Weighted sum (3,) of the ratios of pose errors to residuals, and sum of the weights."""
        self._odometry_square, self._yaw_square = ODOMETRY_STD[0] ** 2 * weight, ODOMETRY_STD[1] ** 2 * weight
        """Weighted sums of the squared errors of odometry: translation along each axis in m², and yaw in rad²."""
        self._step_square = weight
        """Weighted sum of the squared step lengths in m²."""
        self.forget_poses()

    def forget_poses(self) -> None:
        """Forget the stored poses but keep all learned values. Call this when the robot was found elsewhere."""
        self._poses: Array = np.empty((0, 3))
        """Corrected poses (n, 3) in the map frame."""
        self._bases: Array = np.empty((0, 3))
        """Poses (n, 3) of the robot at these corrections, in the frame of the scan matcher."""
        self._drifts: Array = np.empty((0, 3, 3))
        """Covariances (n, 3, 3) of the drift since each correction, in the frame of the scan matcher."""
        self._distances, self._weights = np.empty(0), np.empty(0)
        """Distance driven in m since each correction (n,), and inverse variances of the particles (n,)."""
        self._residuals: deque[ScanResiduals] = deque(maxlen=WINDOW_SIZE)
        self._base: Pose2 | None = None

    def learn_odometry_error(self, matched: Pose2, odometry: Pose2) -> None:
        """Learn the error of odometry from one step, measured by scan matching (`matched`) and by odometry."""
        x, y, yaw = odometry.between(matched)
        self._odometry_square = max(
            0.0,
            FORGETTING_FACTOR * self._odometry_square + (x * x + y * y - COVARIANCE_FLOOR[0] - COVARIANCE_FLOOR[1]) / 2,
        )
        self._yaw_square = max(0.0, FORGETTING_FACTOR * self._yaw_square + yaw * yaw - COVARIANCE_FLOOR[2])
        self._step_square = FORGETTING_FACTOR * self._step_square + step_length(odometry) ** 2

    def propagate(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """Return the covariance (3, 3) of a pose with heading `yaw` after the motion `delta` by odometry."""
        c, s, share = math.cos(yaw), math.sin(yaw), step_length(delta) ** 2 / self._step_square
        translation_variance = self._odometry_square * share
        noise = translation_variance, 0.0, 0.0, translation_variance, 0.0, self._yaw_square * share
        return propagate_covariance(covariance, c * delta.x - s * delta.y, s * delta.x + c * delta.y, noise)

    def propagate_poses(self, base: Pose2, step_covariance: Array | None) -> None:
        """Propagate all stored poses to `base`, the robot's present pose in the frame of the scan matcher.

        `step_covariance` (3, 3) belongs to the step since the last call, in the base frame before the step; None if
        odometry and not scan matching measured the step.
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
            lever @ self._drifts @ lever.T
            + frame @ (step_covariance + np.diag(DRIFT_VARIANCE_PER_M * distance)) @ frame.T
        )
        self._distances = self._distances + distance

    def estimate(self, pose: Pose2, covariance: Array, residuals: ScanResiduals | None) -> Array:
        """Store the corrected `pose` (map frame), and return its covariance (3, 3). Call `propagate_poses` before.

        `covariance` is the covariance of the particles. `residuals` belong to the scan of the correction; None if the
        map explains none of its beams.
        """
        particle_covariance = covariance + MIN_COVARIANCE
        self._add(pose, 1.0 / float(particle_covariance[0, 0] + particle_covariance[1, 1]))
        if residuals is not None:
            self._residuals.append(residuals)
        explained, residual = self._mean_residuals()
        axes = rotation_matrix(pose.yaw).T
        rotated = axes @ particle_covariance @ axes.T
        learned = self._ratio_sum / self._ratio_weight
        scatter = self._scatter_ratio(np.diag(rotated), np.square(learned * residual))
        self._ratio_sum = FORGETTING_FACTOR * self._ratio_sum + scatter / residual
        self._ratio_weight = FORGETTING_FACTOR * self._ratio_weight + 1.0
        expected = residual * self._ratio_sum / self._ratio_weight
        student_std = math.sqrt(DEGREES_OF_FREEDOM / (DEGREES_OF_FREEDOM - 2.0))
        ratio = (scatter + expected) / 2.0 / explained * student_std
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
        """Return the share of explained beams in recent scans, and their RMS residual in units of `sigma_hit`."""
        if not self._residuals:
            return 1.0, 1.0
        explained, square = (sum(values) / len(self._residuals) for values in zip(*self._residuals, strict=True))
        return explained, math.sqrt(max(square / explained, 1e-3))

    def _scatter_ratio(self, variances: Array, expected: Array) -> Array:
        """Return the ratio (3,) of the scatter of poses to the standard deviations of the particles.

        The axes are longitudinal, lateral, and yaw. `variances` (3,) are the variances of the particles. `expected`
        (3,) are the squared ratios that are assumed if no poses with independent errors are stored.
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
        weights = np.square(variances / (variances + drift)) * (self._weights / self._weights.sum())[:, np.newaxis]
        lengths = self._distances[:, np.newaxis] / CORRELATION_LENGTHS_M
        independent = 2.0 * (1.0 - (1.0 + lengths) * np.exp(-lengths))  # by Matérn's correlation of smooth errors
        squares = (weights * np.square(errors)).sum(axis=0) / variances + EXPECTED_WEIGHT * expected
        ratio: Array = np.sqrt(squares / ((weights * independent).sum(axis=0) + EXPECTED_WEIGHT))
        return ratio
