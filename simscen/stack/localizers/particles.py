"""Weighted particles: initial distribution, clusters, and the pose estimate with its covariance."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OccupancyGrid
from simscen.core.geometry import Array, Pose2, wrap, wrap_array
from simscen.core.messages.navigation import Estimate
from simscen.stack.localizers.resampling import BIN_SIZE_M, YAW_BINS, Integers, bin_keys, decode_bins, encode_bins


@dataclass(frozen=True, eq=False)
class Particles:
    """Weighted particles.

    poses:    poses (n, 3) x, y, yaw in the map frame; sums are ten times as fast if columns are contiguous (see
              `empty_poses`)
    weights:  weights (n,), whose sum is 1
    """

    poses: Array
    weights: Array

    @classmethod
    def with_equal_weights(cls, poses: Array) -> "Particles":
        """Return particles with these poses and equal weights."""
        return cls(poses, equal_weights(len(poses)))

    @property
    def effective_count(self) -> float:
        """Effective number of particles: 1 / Σ w² (Liu 1996)."""
        return float(1 / (self.weights @ self.weights))

    def with_weights(self, weights: Array) -> "Particles":
        """Return particles with the same poses and these weights (n,)."""
        other = Particles(self.poses, weights)
        if "bounds" in self.__dict__:
            other.__dict__["bounds"] = self.bounds
        return other

    @cached_property
    def bounds(self) -> list[tuple[float, float]]:
        """Minimum and maximum of x and y in m, and of yaw in rad."""
        return [(values.item(values.argmin()), values.item(values.argmax())) for values in self.poses.T]

    @property
    def extent(self) -> tuple[float, float, float]:
        """Extent of the poses along x and y in m, and in yaw in rad (across ±π if this extent is smaller)."""
        dx, dy, yaw_extent = [highest - lowest for lowest, highest in self.bounds]
        if yaw_extent > math.pi:
            yaw_extent = min(yaw_extent, float(np.ptp(self.poses[:, 2] % (2 * math.pi))))
        return dx, dy, yaw_extent

    @cached_property
    def table(self) -> Array:
        """Poses and weights as one read-only array (n, 4)."""
        table = np.column_stack((self.poses, self.weights))
        table.flags.writeable = False
        return table

    def are_within(self, distance: float) -> bool:
        """Return whether all particles are within `distance` m of their mean, along x and along y."""
        if max(self.extent[:2]) <= distance:
            return True
        positions = self.poses[:, :2]
        return bool((np.abs(positions - positions.mean(axis=0)) <= distance).all())


def empty_poses(count: int) -> Array:
    """Return an uninitialized array for poses (count, 3) with contiguous columns."""
    poses: Array = np.empty((3, count)).T
    return poses


def wrap_headings(headings: Array) -> Array:
    """Return the headings (n,) wrapped to [-π, π). Fast if they are in this interval."""
    if not len(headings):
        return headings
    # argmax takes a fifth of the time of max.
    if headings.item(headings.argmax()) < math.pi and headings.item(headings.argmin()) >= -math.pi:
        return headings
    return wrap_array(headings)


@lru_cache(maxsize=8)
def equal_weights(count: int) -> Array:
    """Return equal weights (count,), read-only and cached."""
    weights: Array = np.full(count, 1 / count)
    weights.flags.writeable = False
    return weights


class FreeSpace:
    """Draws poses uniformly from the free cells of a map; from all cells if none is free."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid

    @cached_property
    def _cells(self) -> npt.NDArray[np.int32]:
        """Flat indices of the cells to draw from."""
        free = np.flatnonzero(self._grid.cells == FREE)
        return (free if len(free) else np.arange(self._grid.cells.size)).astype(np.int32)

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Return random poses (count, 3) in the map frame."""
        row, column = np.divmod(self._cells[rng.integers(len(self._cells), size=count)], self._grid.shape[1])
        local = (np.column_stack((column, row)) + rng.random((count, 2))) * self._grid.resolution
        poses = empty_poses(count)
        poses[:, :2], poses[:, 2] = self._grid.origin.apply(local), rng.uniform(-np.pi, np.pi, count)
        return poses

    def initial_particles(self, estimate: Estimate, count: int, rng: np.random.Generator) -> Particles:
        """Return normally distributed particles around the estimated pose; without a pose, all over the free space."""
        if estimate.pose is None:
            return Particles.with_equal_weights(self.draw(count, rng))
        poses = empty_poses(count)
        poses[:] = rng.normal(estimate.pose, estimate.std, (count, 3))
        poses[:, 2] = wrap_array(poses[:, 2])
        return Particles.with_equal_weights(poses)


MAX_COMPACT_BINS = 8
"""Maximum number of histogram bins in which compact particles (see `are_compact`) can be."""
_NEIGHBORS = np.array([(x, y, a) for x in (-1, 0, 1) for y in (-1, 0, 1) for a in (-1, 0, 1)])
"""Offsets (27, 3) in x, y, and yaw from a bin to itself and all adjacent bins."""


def cluster_labels(keys: Integers) -> Integers:
    """Return a cluster label (n,) for each particle, given the keys (n,) of their histogram bins.

    Adjacent bins form a cluster. Bins are also adjacent at corners, and across ±180° of the heading.
    """
    occupied, bin_index = np.unique(keys, return_inverse=True)
    x, y, yaw = decode_bins(occupied)
    neighbor_keys = encode_bins(x + _NEIGHBORS[:, :1], y + _NEIGHBORS[:, 1:2], (yaw + _NEIGHBORS[:, 2:]) % YAW_BINS)
    candidates = np.minimum(np.searchsorted(occupied, neighbor_keys), len(occupied) - 1)
    labels = np.arange(len(occupied))
    neighbors = np.where(occupied[candidates] == neighbor_keys, candidates, labels)
    while True:
        lowest = labels[neighbors].min(axis=0)
        if np.array_equal(lowest, labels):
            return labels[bin_index]
        labels = lowest[lowest]


def summarize(particles: Particles, peak_power: float = 1.0) -> tuple[Pose2, Array]:
    """Return the mean pose of the heaviest cluster, and the covariance (3, 3) of all particles about this pose.

    With `peak_power` 1, the result is the weighted mean, as in nav2_amcl. Otherwise, the weighted mean is combined with
    a second mean, for which weights are raised to `peak_power`. The second mean lags less behind a moving robot. Both
    means are weighted by the inverse of their variances (see docs/reference/localizers.md).
    """
    poses, weights = particles.poses, particles.weights
    if are_compact(particles):
        if peak_power == 1.0:
            return _summarize_compact(particles)
    elif _are_in_adjacent_bins(particles):
        poses = np.ascontiguousarray(poses)  # so that sums have the same rounding errors as for a selected cluster
    else:
        labels = cluster_labels(bin_keys(poses))
        heaviest = labels == np.bincount(labels, weights=weights).argmax()
        poses, weights = poses[heaviest], weights[heaviest]
    mean = _mean(poses, weights)
    if peak_power == 1.0:
        return mean, covariance_about(particles, mean)
    peaked = (weights / weights.max()) ** peak_power
    best = _mean(poses, peaked)
    variance, peak_variance = _position_variance(poses, weights, mean), _position_variance(poses, peaked, best)
    share = variance / (variance + peak_variance) if peak_variance > 0 else 1.0
    yaw = wrap(mean.yaw + share * wrap(best.yaw - mean.yaw))
    pose = Pose2(mean.x + share * (best.x - mean.x), mean.y + share * (best.y - mean.y), yaw)
    return pose, covariance_about(particles, pose)


def _summarize_compact(particles: Particles) -> tuple[Pose2, Array]:
    """Return the same as `summarize` for compact particles with `peak_power` 1, in one matrix product."""
    first: tuple[float, float, float] = tuple(particles.poses[0].tolist())
    offsets = np.ones((4, len(particles.weights)))
    np.subtract(particles.poses.T, np.array([first]).T, offsets[:3])
    offsets[2] = wrap_headings(offsets[2])
    (xx, xy, xa, x), (_, yy, ya, y), (_, _, aa, a), (*_, total) = np.dot(
        offsets * particles.weights, offsets.T
    ).tolist()
    dx, dy, turn = x / total, y / total, a / total
    xy, xa, ya = xy - dx * y, xa - dx * a, ya - dy * a
    pose = Pose2(first[0] + dx, first[1] + dy, wrap(first[2] + turn))
    return pose, np.array(((xx - dx * x, xy, xa), (xy, yy - dy * y, ya), (xa, ya, aa - turn * a)))


def are_compact(particles: Particles) -> bool:
    """Return whether the extent of the particles is less than one histogram bin, so that they are one cluster."""
    x, y, yaw = particles.extent
    return x < BIN_SIZE_M and y < BIN_SIZE_M and yaw < 2 * math.pi / YAW_BINS


def _are_in_adjacent_bins(particles: Particles) -> bool:
    """Return whether all particles are in adjacent histogram bins, so that they are one cluster.

    Yaw is not wrapped: particles on both sides of ±180° count as not adjacent.
    """
    bins_per_unit = (1 / BIN_SIZE_M, 1 / BIN_SIZE_M, YAW_BINS / (2 * math.pi))
    return all(
        math.floor(highest * scale) - math.floor(lowest * scale) <= 1
        for (lowest, highest), scale in zip(particles.bounds, bins_per_unit, strict=True)
    )


def _mean(poses: Array, weights: Array) -> Pose2:
    """Return the mean of poses (n, 3) with weights (n,)."""
    total, yaw = float(np.add.reduce(weights)), poses[:, 2]
    x, y = (weights @ poses[:, :2]).tolist()
    return Pose2(x / total, y / total, math.atan2(weights @ np.sin(yaw), weights @ np.cos(yaw)))


def _position_variance(poses: Array, weights: Array, mean: Pose2) -> float:
    """Return the variance of the positions of poses (n, 3) with weights (n,) about their mean, in m²."""
    return float(weights @ np.square(poses[:, :2] - mean[:2]).sum(axis=1) / weights.sum())


def covariance_about(particles: Particles, pose: Pose2) -> Array:
    """Return the covariance (3, 3) of the particles about `pose`."""
    error = pose_errors(np.array(pose), particles.poses).T
    covariance: Array = (error * particles.weights) @ error.T
    return covariance


def pose_errors(pose: Array, poses: Array) -> Array:
    """Return the differences (n, 3) of `poses` from `pose` (3,), with wrapped headings."""
    error = poses - pose
    error[:, 2] = wrap_headings(error[:, 2])
    return error
