"""Weighted set of particles, initialized around a pose or over all free space."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OccupancyGrid
from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.messages.navigation import Estimate


@dataclass(frozen=True, eq=False)
class Particles:
    """Poses (n, 3) x, y, yaw in the map frame and their weights (n,), which add up to one.

    Sums are ten times as fast if each column is contiguous, see `columns`.
    """

    poses: Array
    weights: Array

    @classmethod
    def equal(cls, poses: Array) -> "Particles":
        """Return particles with these poses and equal weights."""
        return cls(poses, equal_weights(len(poses)))

    @property
    def effective(self) -> float:
        """Effective number of particles: 1 / Σ w² (Liu 1996)."""
        return float(1 / (self.weights @ self.weights))

    def weighted(self, weights: Array) -> "Particles":
        """Return the same poses with other weights (n,)."""
        other = Particles(self.poses, weights)
        if "extent" in self.__dict__:
            other.__dict__["extent"] = self.extent
        return other

    @cached_property
    def extent(self) -> tuple[float, float, float]:
        """Extent in x, y, and yaw. Headings on both sides of ±π are close to each other."""
        dx, dy, turned = [values.item(values.argmax()) - values.item(values.argmin()) for values in self.poses.T]
        if turned > math.pi:
            turned = min(turned, float(np.ptp(self.poses[:, 2] % (2 * math.pi))))
        return dx, dy, turned

    @cached_property
    def table(self) -> Array:
        """Poses and weights as one read-only array (n, 4)."""
        table = np.column_stack((self.poses, self.weights))
        table.flags.writeable = False
        return table

    def within(self, distance: float) -> bool:
        """Return whether each particle is at most this far from their mean, in x and in y."""
        if max(self.extent[:2]) <= distance:
            return True
        positions = self.poses[:, :2]
        return bool((np.abs(positions - positions.mean(axis=0)) <= distance).all())


def sample_around(pose: Pose2, std: tuple[float, float, float], count: int, rng: np.random.Generator) -> Array:
    """Return poses (count, 3) drawn from a normal distribution about `pose`, as nav2_amcl's pf_init does."""
    poses = columns(count)
    poses[:] = rng.normal(pose, std, (count, 3))
    poses[:, 2] = wrap_array(poses[:, 2])
    return poses


def columns(count: int) -> Array:
    """Return an empty array for poses (count, 3) with contiguous columns."""
    poses: Array = np.empty((3, count)).T
    return poses


def wrapped(headings: Array) -> Array:
    """Return the headings (n,) in [-π, π). Fast if they already are."""
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
    """Draws poses uniformly from the free cells of a map, or from all cells if none is free."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid

    @cached_property
    def _cells(self) -> npt.NDArray[np.int32]:
        """Indices of the cells to draw from. Computed when first needed, because large maps have many."""
        free = np.flatnonzero(self._grid.cells == FREE)
        return (free if len(free) else np.arange(self._grid.cells.size)).astype(np.int32)

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Return poses (count, 3) in the map frame."""
        row, column = np.divmod(self._cells[rng.integers(len(self._cells), size=count)], self._grid.shape[1])
        local = (np.column_stack((column, row)) + rng.random((count, 2))) * self._grid.resolution
        poses = columns(count)
        poses[:, :2], poses[:, 2] = self._grid.origin.apply(local), rng.uniform(-np.pi, np.pi, count)
        return poses

    def begin(self, estimate: Estimate, count: int, rng: np.random.Generator) -> Particles:
        """Return particles around the estimate's pose, or over all free space if it has none."""
        if estimate.pose is None:
            return Particles.equal(self.draw(count, rng))
        return Particles.equal(sample_around(estimate.pose, estimate.std, count, rng))
