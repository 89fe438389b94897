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

    Columns that lie in one piece are summed up ten times as fast: see `columns`.
    """

    poses: Array
    weights: Array

    @classmethod
    def equal(cls, poses: Array) -> "Particles":
        """All of these poses are equally likely."""
        return cls(poses, alike(len(poses)))

    @property
    def effective(self) -> float:
        """How many equally weighted particles would do as well: 1 / Σ w² (Liu 1996)."""
        return float(1 / (self.weights @ self.weights))

    def weighted(self, weights: Array) -> "Particles":
        """The same poses with other weights (n,)."""
        other = Particles(self.poses, weights)
        if "extent" in self.__dict__:
            other.__dict__["extent"] = self.extent
        return other

    @cached_property
    def extent(self) -> tuple[float, float, float]:
        """How far they lie apart in x, y and yaw, about -π as elsewhere."""
        dx, dy, turned = [values.item(values.argmax()) - values.item(values.argmin()) for values in self.poses.T]
        if turned > math.pi:
            turned = min(turned, float(np.ptp(self.poses[:, 2] % (2 * math.pi))))
        return dx, dy, turned

    @cached_property
    def table(self) -> Array:
        """Poses and weights as one array (n, 4) that nobody can write to."""
        table = np.column_stack((self.poses, self.weights))
        table.flags.writeable = False
        return table

    def within(self, distance: float) -> bool:
        """Whether every particle is at most this far from their mean, in x and in y."""
        if max(self.extent[:2]) <= distance:
            return True
        places = self.poses[:, :2]
        return bool((np.abs(places - places.mean(axis=0)) <= distance).all())


def around(pose: Pose2, std: tuple[float, float, float], count: int, rng: np.random.Generator) -> Array:
    """Poses (count, 3) drawn from a normal distribution about `pose`, as nav2_amcl's pf_init does."""
    poses = columns(count)
    poses[:] = rng.normal(pose, std, (count, 3))
    poses[:, 2] = wrap_array(poses[:, 2])
    return poses


def columns(count: int) -> Array:
    """Room for poses (count, 3), each column in one piece."""
    poses: Array = np.empty((3, count)).T
    return poses


def wrapped(headings: Array) -> Array:
    """Headings (n,) in [-π, π), where most of the time they are."""
    if not len(headings):
        return headings
    # Where the greatest is takes a fifth of the time that the greatest does.
    if headings.item(headings.argmax()) < math.pi and headings.item(headings.argmin()) >= -math.pi:
        return headings
    return wrap_array(headings)


@lru_cache(maxsize=8)
def alike(count: int) -> Array:
    """Weights (count,) of particles that are equally likely; not to be written to."""
    weights: Array = np.full(count, 1 / count)
    weights.flags.writeable = False
    return weights


class FreeSpace:
    """Draws poses uniformly over the free cells of a map; over all cells if none is free."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid

    @cached_property
    def _cells(self) -> npt.NDArray[np.int32]:
        """All that it draws from: only who is lost does, and of a large map they are many."""
        free = np.flatnonzero(self._grid.cells == FREE)
        return (free if len(free) else np.arange(self._grid.cells.size)).astype(np.int32)

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Poses (count, 3) in the map frame."""
        row, column = np.divmod(self._cells[rng.integers(len(self._cells), size=count)], self._grid.shape[1])
        local = (np.column_stack((column, row)) + rng.random((count, 2))) * self._grid.resolution
        poses = columns(count)
        poses[:, :2], poses[:, 2] = self._grid.origin.apply(local), rng.uniform(-np.pi, np.pi, count)
        return poses

    def begin(self, estimate: Estimate, count: int, rng: np.random.Generator) -> Particles:
        """Particles for an estimate: around its pose, or anywhere when it has none."""
        if estimate.pose is None:
            return Particles.equal(self.draw(count, rng))
        return Particles.equal(around(estimate.pose, estimate.std, count, rng))
