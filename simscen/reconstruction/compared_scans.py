"""Comparison of the measured ranges of scans with the ranges that are expected in the static world.

The static world has walls and known obstacles, but not the objects that the reconstruction has to find.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import Mask, RecordedDrive, Scans
from simscen.reconstruction.static_world import StaticWorld, beam_ends, lidar_poses

TRUE_POSE_TOLERANCE_M, ESTIMATED_POSE_TOLERANCE_M = 0.12, 0.25
"""Tolerated difference between measured and expected range, for drives with true poses and with estimated poses."""
ESTIMATED_POSE_TOLERANCE_PER_M = 0.02
"""Additional tolerance for estimated poses per meter of range."""
NOISE_SIGMAS = 4.0
"""Additional tolerance, as a multiple of the standard deviation of the range noise."""
MAX_NOISE_M = 0.3
"""Upper bound of the standard deviation of the range noise from which the additional tolerance is computed."""
MAD_TO_STD = 1.4826
"""Factor from the median absolute deviation to the standard deviation of a normal distribution."""
INVALID_SCAN_MAX_HIT_FRACTION, MIN_EXPECTED_HIT_FRACTION = 0.1, 0.3
"""Limits for a scan that is invalid because it has hardly any hit: maximum fraction of beams with a hit, and minimum
fraction of beams for which a hit is expected."""
MAX_SMOOTH_STEP_M = 0.1
"""Maximum difference between the expected ranges of neighbor beams that end at the same smooth surface."""
MIN_SMOOTH_BEAMS = 10
"""Minimum number of beams on smooth surfaces for an estimate of the noise of a scan."""
DEFAULT_NOISE_M = 0.01
"""Standard deviation of the range noise if it cannot be estimated from any scan."""


@dataclass(frozen=True, eq=False)
class ComparedScans:
    """Measured scans, and the ranges that are expected in the static world.

    Attributes:
        scans: Measured scans.
        poses: Poses x, y, yaw (n, 3) of the lidar in the map frame.
        expected: Expected ranges (n, beams) in m; inf beyond the maximum range of the lidar.
        noise: Standard deviation (n,) in m of the range noise of each scan.
        tolerance: Tolerated differences (n, beams) in m between measured and expected ranges.
    """

    scans: Scans
    poses: Array
    expected: Array
    noise: Array
    tolerance: Array

    @cached_property
    def is_hit(self) -> Mask:
        """Mask (n, beams) of beams with a measured range within the limits of the lidar."""
        return self.scans.is_hit()

    @cached_property
    def residuals(self) -> Array:
        """Measured minus expected ranges (n, beams) in m; nan without a measured or an expected range."""
        return _residuals(self.scans, self.expected)

    @cached_property
    def is_invalid(self) -> Mask:
        """Mask (n,) of scans with a wrong number of beams, or with hardly any hit where hits are expected."""
        hits, expected_hits = self.is_hit.mean(axis=1), np.isfinite(self.expected).mean(axis=1)
        lacks_hits: Mask = (hits < INVALID_SCAN_MAX_HIT_FRACTION) & (expected_hits > MIN_EXPECTED_HIT_FRACTION)
        return self.scans.is_malformed | lacks_hits

    @cached_property
    def is_explained(self) -> Mask:
        """Mask (n, beams) of beams that end at a wall of the static world, within the tolerance."""
        with np.errstate(invalid="ignore"):
            ranges = self.scans.ranges
            return (
                self.is_hit & (ranges >= self._nearest - self.tolerance) & (ranges <= self._farthest + self.tolerance)
            )

    @cached_property
    def is_short(self) -> Mask:
        """Mask (n, beams) of beams that end in front of the static world by more than the tolerance."""
        with np.errstate(invalid="ignore"):
            return self.is_hit & (self.scans.ranges < self._nearest - self.tolerance)

    @cached_property
    def passes_through(self) -> Mask:
        """Mask (n, beams) of beams that end behind a wall, or have no return although a wall is in range."""
        with np.errstate(invalid="ignore"):
            behind = self.is_hit & (self.scans.ranges > self._farthest + self.tolerance)
        return behind | (self.is_missing & (self._farthest + self.tolerance < self.scans.range_max))

    @cached_property
    def is_missing(self) -> Mask:
        """Mask (n, beams) of beams without a return up to the maximum range."""
        with np.errstate(invalid="ignore"):
            missing: Mask = (self.scans.ranges == np.inf) | (self.scans.ranges > self.scans.range_max)
        return missing

    @cached_property
    def ends(self) -> Array:
        """Ends (n, beams, 2) of the beams in the map frame."""
        return beam_ends(self.poses, self.scans.angles, self.scans.ranges)

    @cached_property
    def _nearest(self) -> Array:
        """Smallest expected range of each beam and its two neighbors."""
        return _reduce_neighbors(self.expected, np.minimum)

    @cached_property
    def _farthest(self) -> Array:
        """Largest expected range of each beam and its two neighbors."""
        return _reduce_neighbors(self.expected, np.maximum)


def _reduce_neighbors(values: Array, reduce: np.ufunc) -> Array:
    """Return the values (n, beams) after `reduce`, a minimum or maximum, over each beam and its two neighbors."""
    result: Array = values.copy()
    reduce(result[:, 1:], values[:, :-1], out=result[:, 1:])
    reduce(result[:, :-1], values[:, 1:], out=result[:, :-1])
    return result


def compare_scans(drive: RecordedDrive, scans: Scans, world: StaticWorld) -> ComparedScans:
    """Compare scans of a drive with the static world. The poses of the drive are used as poses of the robot."""
    poses = lidar_poses(drive, scans)
    expected = world.ranges_from(poses, scans.angles, scans.range_max)
    noise = range_noise(_residuals(scans, expected), expected)
    base_tolerance = TRUE_POSE_TOLERANCE_M if drive.has_true_poses else ESTIMATED_POSE_TOLERANCE_M
    tolerance_per_m = 0.0 if drive.has_true_poses else ESTIMATED_POSE_TOLERANCE_PER_M
    noise_tolerance = NOISE_SIGMAS * np.minimum(noise, MAX_NOISE_M)[:, None]
    tolerance = base_tolerance + noise_tolerance + tolerance_per_m * np.minimum(expected, scans.range_max)
    return ComparedScans(scans, poses, expected, noise, tolerance)


def _residuals(scans: Scans, expected: Array) -> Array:
    """Return measured minus expected ranges (n, beams) in m; nan without a measured or an expected range."""
    with np.errstate(invalid="ignore"):
        return np.where(scans.is_hit() & np.isfinite(expected), scans.ranges - expected, np.nan)


def range_noise(residuals: Array, expected: Array) -> Array:
    """Return the standard deviation (n,) in m of the range noise of each scan.

    `residuals` and `expected` (n, beams) are as in ComparedScans. The noise is estimated from second differences
    between neighbor beams on smooth surfaces. A scan with fewer than MIN_SMOOTH_BEAMS of these beams has the median
    noise of the other scans.
    """
    with np.errstate(invalid="ignore"):
        steps = np.abs(np.diff(expected, axis=1))
        is_smooth = (steps[:, 1:] < MAX_SMOOTH_STEP_M) & (steps[:, :-1] < MAX_SMOOTH_STEP_M)
        # The variance of a second difference is 6 times the variance of the noise.
        differences = np.abs(residuals[:, :-2] - 2 * residuals[:, 1:-1] + residuals[:, 2:]) / np.sqrt(6.0)
        differences = np.where(is_smooth & (differences < 1.0), differences, np.nan)
    has_estimate = np.isfinite(differences).sum(axis=1) >= MIN_SMOOTH_BEAMS
    noise = np.full(len(residuals), np.nan)
    if has_estimate.any():
        noise[has_estimate] = MAD_TO_STD * np.nanmedian(differences[has_estimate], axis=1)
    median_noise = float(np.nanmedian(noise)) if has_estimate.any() else DEFAULT_NOISE_M
    return np.where(np.isfinite(noise), noise, median_noise)
