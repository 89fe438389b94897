"""Likelihood field sensor models: likelihood of a scan by the distance of its endpoints from obstacles.

Likelihood fields: Thrun, Burgard & Fox, Probabilistic Robotics, section 6.4 and table 6.3; nav2_amcl's
likelihood_field_model.cpp and likelihood_field_model_prob.cpp. Beams that hit nothing say nothing.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.distance_field import DistanceField, Float32, by_blocks

PEAK_OF_SUMS = 16.0
"""Of models whose particles weigh 1 + Σ p³: over 60 beams, one that fits makes a particle but 1 or 2 % heavier."""
STRAYS_OF_SUMS = 0.05
"""Of the same models: a particle anywhere weighs half as much as a good one, and outlives many scans."""


class SensorModel(Protocol):
    """Judges particles by a scan."""

    @property
    def peak(self) -> float:
        """The power that brings out which particles are best: 1 where weights are the likelihood of all beams."""
        ...

    @property
    def strays(self) -> float:
        """The largest share of new particles that recovery may put anywhere with each scan."""
        ...

    def log_likelihood(self, poses: Array, beams: Beams, converged: bool) -> Array:
        """Logarithms (n,) of how likely the beams are at each of `poses` (n, 3); -inf for impossible, never nan.

        `converged` says that the particles are one narrow group.
        """
        ...

    def tempering(self, beams: Beams) -> float:
        """The exponent that puts likelihoods of any scan on one scale: 1/beams for a product, 1 for a bounded sum."""
        ...


def obstacle_field(grid: OccupancyGrid, max_distance: float) -> DistanceField:
    """Distances to the surfaces of what is occupied; off the map counts as far from everything, as in nav2_amcl.

    A beam cannot end inside a solid. Nav2's maps come from SLAM, which draws surfaces only; a map that was rasterized
    from a model is filled, and if the inside counted as near, particles would be drawn into what they look at.
    """
    return DistanceField(grid, surfaces(grid.cells == OCCUPIED), max_distance, walled=False)


def surfaces(solid: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Solid cells (height, width) with a neighbor that is not; what is off the map does not count as one."""
    padded = np.pad(solid, 1, constant_values=True)
    inside = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return solid & ~inside


class LikelihoodField:
    """Nav2's default: a particle weighs 1 + Σ p³ over its beams.

    Not a product of probabilities: Nav2 calls it "an ad-hoc weighting scheme" that "works well". It forgives beams
    that hit what is not on the map, and it never says that a pose is impossible.
    """

    peak, strays = PEAK_OF_SUMS, STRAYS_OF_SUMS

    def __init__(self, field: DistanceField, z_hit: float, z_rand: float, sigma_hit: float) -> None:
        self._field, self._z_rand = field, np.float32(z_rand)
        self._hit = _hit_likelihoods(field, z_hit, sigma_hit)

    def log_likelihood(self, poses: Array, beams: Beams, converged: bool) -> Array:
        """Logarithms (n,) of 1 + Σ p³."""
        z_rand = self._z_rand / np.float32(beams.range_max)

        def judge(block: Array) -> Array:
            p = self._hit.take(beams.cells(self._field, block))
            p += z_rand
            logarithm: Array = np.log1p(np.sum(p * p * p, axis=1, dtype=np.float64))
            return logarithm

        return by_blocks(judge, poses)

    def tempering(self, beams: Beams) -> float:
        """A sum of cubes says little however many beams there are."""
        return 1.0


@dataclass(frozen=True)
class BeamSkipping:
    """When converged, leave out beams that too few particles can explain: people, not the map.

    A beam counts as explained by a particle when it ends less than `distance` m from an obstacle. It is left out
    when at most the share `threshold` of the particles explain it, unless the share of beams to be left out reaches
    `error_threshold`: then it is the pose that is wrong, and every beam counts.
    """

    distance: float
    threshold: float
    error_threshold: float


class LikelihoodFieldProb:
    """A particle's weight is the product of its beams' likelihoods (table 6.3), with optional beam skipping.

    Subclasses may set `exponent` and override `_hit_likelihoods`.
    """

    peak, strays = 1.0, 1.0
    exponent = 1.0
    """Power to which the product is raised."""

    def __init__(
        self, field: DistanceField, z_hit: float, z_rand: float, sigma_hit: float, skipping: BeamSkipping | None = None
    ) -> None:  # fmt: skip
        self._field, self._z_rand, self._skipping = field, np.float32(z_rand), skipping
        self._z_hit, self._sigma_hit = z_hit, sigma_hit
        self._range_max, self._logarithm = math.nan, field.table
        self._exponents: Float32 = np.empty(0, dtype=np.float32)

    def log_likelihood(self, poses: Array, beams: Beams, converged: bool) -> Array:
        """Return the logarithms (n,) of the product."""
        kept = self._kept(poses, beams, self._skipping) if self._skipping is not None and converged else slice(None)
        logarithms, exponents = self._logarithms(beams.range_max), self._beam_exponents(len(beams.ends))[kept]

        def weigh(block: Array) -> Array:
            cells = beams.cells(self._field, block)[:, kept]
            # All indices are valid; mode="wrap" skips the check.
            return (logarithms.take(cells, mode="wrap") @ exponents).astype(np.float64)

        return by_blocks(weigh, poses)

    def tempering(self, beams: Beams) -> float:
        """Return the exponent of the geometric mean over the beams that hit something."""
        return 1 / max(1, int(np.count_nonzero(beams.ranges < beams.range_max))) / self.exponent

    def _beam_exponents(self, beams: int) -> Float32:
        """Return `exponent` once for each beam; a matrix product sums faster than numpy's sum."""
        if beams != len(self._exponents):
            self._exponents = np.full(beams, self.exponent, dtype=np.float32)
        return self._exponents

    def _logarithms(self, range_max: float) -> Float32:
        """Return the log likelihood of a beam that ends in each cell, for a lidar with this maximum range."""
        if range_max != self._range_max:
            likelihoods = self._hit_likelihoods()
            likelihoods += self._z_rand / np.float32(range_max)
            with np.errstate(divide="ignore"):
                self._logarithm = np.log(likelihoods, out=likelihoods)
            self._range_max = range_max
        return self._logarithm

    def _hit_likelihoods(self) -> Float32:
        """Return the likelihood of a hit in each cell, without the random part."""
        return _hit_likelihoods(self._field, self._z_hit, self._sigma_hit)

    def _kept(self, poses: Array, beams: Beams, skipping: BeamSkipping) -> npt.NDArray[np.bool_] | slice:
        """Return which beams enough particles can explain; all of them if too few beams are left."""
        near = self._field.table.take(beams.cells(self._field, poses)) < skipping.distance
        explained: npt.NDArray[np.bool_] = near.mean(axis=0) > skipping.threshold
        is_pose_wrong = np.count_nonzero(~explained) >= len(explained) * skipping.error_threshold
        return slice(None) if is_pose_wrong else explained


def _hit_likelihoods(field: DistanceField, z_hit: float, sigma_hit: float) -> Float32:
    """Return z_hit · exp(-d² / 2σ²) of each cell's distance d to the nearest obstacle."""
    return field.told(lambda d: np.float32(z_hit) * np.exp(np.square(d) / np.float32(-2 * sigma_hit**2)), np.float32)
