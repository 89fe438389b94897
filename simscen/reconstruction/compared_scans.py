"""Comparison of scans with the static world: beams that end at it, before it, and behind it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import Mask, RecordedDrive, Scans
from simscen.reconstruction.static_world import StaticWorld, beam_ends, lidar_poses

TRUE_POSE_TOLERANCE_M, BELIEVED_POSE_TOLERANCE_M = 0.12, 0.25
"""Difference between a range and the world that errors of the pose cause."""
BELIEVED_POSE_TOLERANCE_PER_M = 0.02
"""The same per meter of range, because of errors of the heading."""
NOISE_SIGMAS = 4.0
"""Difference between a range and the world that noise explains, in standard deviations."""
MAD_TO_STD = 1.4826
"""Factor from the median absolute deviation to the standard deviation of a normal distribution."""
SMOOTH_STEP_M = 0.1
"""Maximum difference between the expected ranges of neighbor beams on one surface."""


@dataclass(frozen=True, eq=False)
class ComparedScans:
    """Scans of a drive beside what the static world predicts.

    Attributes:
        scans: The measured scans.
        poses: Poses (n, 3) of the lidar in the map frame.
        expected: Ranges (n, beams) to the static world; inf if it is out of reach.
        noise: Standard deviation (n,) of the ranges of each scan in m.
        tolerance: Differences (n, beams) in m that noise and errors of the pose explain.
    """

    scans: Scans
    poses: Array
    expected: Array
    noise: Array
    tolerance: Array

    @cached_property
    def is_hit(self) -> Mask:
        """Beams (n, beams) that measured something."""
        return self.scans.is_hit()

    @cached_property
    def residuals(self) -> Array:
        """Measured minus expected range (n, beams) in m; nan where one of them is missing."""
        with np.errstate(invalid="ignore"):
            return np.where(self.is_hit & np.isfinite(self.expected), self.scans.ranges - self.expected, np.nan)

    @cached_property
    def is_explained(self) -> Mask:
        """Beams (n, beams) that end at the static world."""
        with np.errstate(invalid="ignore"):
            ranges = self.scans.ranges
            return (
                self.is_hit & (ranges >= self._nearest - self.tolerance) & (ranges <= self._farthest + self.tolerance)
            )

    @cached_property
    def is_short(self) -> Mask:
        """Beams (n, beams) that end clearly before the static world."""
        with np.errstate(invalid="ignore"):
            return self.is_hit & (self.scans.ranges < self._nearest - self.tolerance)

    @cached_property
    def passes_through(self) -> Mask:
        """Beams (n, beams) that end clearly behind a surface of the static world, or measure nothing."""
        with np.errstate(invalid="ignore"):
            behind = self.is_hit & (self.scans.ranges > self._farthest + self.tolerance)
        return behind | (self.is_missing & (self._farthest + self.tolerance < self.scans.range_max))

    @cached_property
    def is_missing(self) -> Mask:
        """Beams (n, beams) that measured nothing up to the maximum range."""
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
    """Return the minimum or maximum of each beam and its neighbors, because an edge can lie between two beams."""
    result: Array = values.copy()
    choose(result[:, 1:], values[:, :-1], out=result[:, 1:])
    choose(result[:, :-1], values[:, 1:], out=result[:, :-1])
    return result


def compare_scans(drive: RecordedDrive, scans: Scans, world: StaticWorld) -> ComparedScans:
    """Compare scans with the static world."""
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
    """Return the standard deviation (n,) of the ranges of each scan, nan with too few beams on smooth surfaces.

    It is computed from the differences between neighbor beams, so that errors of the pose do not count.
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
