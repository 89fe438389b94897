"""Compares each range of a scan with the range that is expected in the static world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import Mask, RecordedDrive, Scans
from simscen.reconstruction.static_world import StaticWorld, beam_ends, lidar_poses

TRUE_POSE_TOLERANCE_M, BELIEVED_POSE_TOLERANCE_M = 0.12, 0.25
"""Difference from the expected range that errors of true poses, or of estimated poses, explain."""
BELIEVED_POSE_TOLERANCE_PER_M = 0.02
"""Additional difference per meter of range that errors of an estimated heading explain."""
NOISE_SIGMAS = 4.0
"""Difference from the expected range that noise explains, in standard deviations of the noise."""
MAD_TO_STD = 1.4826
"""Factor from the median absolute deviation to the standard deviation of a normal distribution."""
SMOOTH_STEP_M = 0.1
"""If the expected ranges of neighbor beams differ by less than this, both beams end at the same smooth surface."""


@dataclass(frozen=True, eq=False)
class ComparedScans:
    """Measured scans with the ranges that are expected in the static world.

    Attributes:
        poses: Poses x, y, yaw (n, 3) of the lidar in the map frame.
        expected: Expected ranges (n, beams) in m; inf beyond the maximum range of the lidar.
        noise: Standard deviation (n,) of the range noise of each scan in m.
        tolerance: Differences (n, beams) in m between measured and expected range that noise and pose errors explain.
    """

    scans: Scans
    poses: Array
    expected: Array
    noise: Array
    tolerance: Array

    @cached_property
    def is_hit(self) -> Mask:
        """Which beams (n, beams) measured a range within the limits of the lidar."""
        return self.scans.is_hit()

    @cached_property
    def residuals(self) -> Array:
        """Measured minus expected ranges (n, beams) in m; nan where one of them is missing."""
        with np.errstate(invalid="ignore"):
            return np.where(self.is_hit & np.isfinite(self.expected), self.scans.ranges - self.expected, np.nan)

    @cached_property
    def is_explained(self) -> Mask:
        """Which beams (n, beams) end at the static world, within the tolerance."""
        with np.errstate(invalid="ignore"):
            ranges = self.scans.ranges
            return (
                self.is_hit & (ranges >= self._nearest - self.tolerance) & (ranges <= self._farthest + self.tolerance)
            )

    @cached_property
    def is_short(self) -> Mask:
        """Which beams (n, beams) end before the static world, by more than the tolerance."""
        with np.errstate(invalid="ignore"):
            return self.is_hit & (self.scans.ranges < self._nearest - self.tolerance)

    @cached_property
    def passes_through(self) -> Mask:
        """Which beams (n, beams) end behind the static world by more than the tolerance, or miss it within range."""
        with np.errstate(invalid="ignore"):
            behind = self.is_hit & (self.scans.ranges > self._farthest + self.tolerance)
        return behind | (self.is_missing & (self._farthest + self.tolerance < self.scans.range_max))

    @cached_property
    def is_missing(self) -> Mask:
        """Which beams (n, beams) measured nothing up to the maximum range: inf, or a larger range."""
        with np.errstate(invalid="ignore"):
            missing: Mask = (self.scans.ranges == np.inf) | (self.scans.ranges > self.scans.range_max)
        return missing

    @cached_property
    def ends(self) -> Array:
        """Ends (n, beams, 2) of the beams in the map frame."""
        return beam_ends(self.poses, self.scans.angles, self.scans.ranges)

    @cached_property
    def _nearest(self) -> Array:
        return _over_neighbors(self.expected, np.minimum)

    @cached_property
    def _farthest(self) -> Array:
        return _over_neighbors(self.expected, np.maximum)


def _over_neighbors(values: Array, choose: np.ufunc) -> Array:
    """Return for each beam `choose` (minimum or maximum) of it and its two neighbors: an edge can lie between beams."""
    result: Array = values.copy()
    choose(result[:, 1:], values[:, :-1], out=result[:, 1:])
    choose(result[:, :-1], values[:, 1:], out=result[:, :-1])
    return result


def compare_scans(drive: RecordedDrive, scans: Scans, world: StaticWorld) -> ComparedScans:
    """Compare scans of a drive with the static world, from the poses of the drive."""
    poses = lidar_poses(drive, scans)
    expected = world.ranges_from(poses, scans.angles, scans.range_max)
    with np.errstate(invalid="ignore"):
        residuals = np.where(scans.is_hit() & np.isfinite(expected), scans.ranges - expected, np.nan)
    noise = range_noise(residuals, expected)
    fixed = TRUE_POSE_TOLERANCE_M if drive.has_true_poses else BELIEVED_POSE_TOLERANCE_M
    growth = 0.0 if drive.has_true_poses else BELIEVED_POSE_TOLERANCE_PER_M
    reach = np.minimum(expected, scans.range_max)
    tolerance = fixed + NOISE_SIGMAS * np.minimum(noise, 0.3)[:, None] + growth * reach
    return ComparedScans(scans, poses, expected, noise, tolerance)


def range_noise(residuals: Array, expected: Array) -> Array:
    """Return the standard deviation (n,) of the range noise of each scan in m, from residuals and expected ranges.

    It is computed from differences between neighbor beams on smooth surfaces, to which errors of the pose add nothing.
    Scans with too few of these beams have the median of the other scans.
    """
    with np.errstate(invalid="ignore"):
        steps = np.abs(np.diff(expected, axis=1))
        smooth = (steps[:, 1:] < SMOOTH_STEP_M) & (steps[:, :-1] < SMOOTH_STEP_M)
        bends = (residuals[:, :-2] - 2 * residuals[:, 1:-1] + residuals[:, 2:]) / np.sqrt(6.0)
        bends = np.where(smooth & (np.abs(bends) < 1.0), np.abs(bends), np.nan)
    enough = np.isfinite(bends).sum(axis=1) >= 10
    noise = np.full(len(residuals), np.nan)
    if enough.any():
        noise[enough] = MAD_TO_STD * np.nanmedian(bends[enough], axis=1)
    usual = float(np.nanmedian(noise)) if enough.any() else 0.01
    return np.where(np.isfinite(noise), noise, usual)
