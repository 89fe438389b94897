"""How well a scan fits the map, judged by how near its ends are to obstacles.

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


SAYS_NOTHING = 0.4
"""Of a hit's likelihood: what a beam has that ends where the map says nothing, about that of a beam of a robot that
knows where it is, on geometric average."""


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

    A beam cannot end inside a solid. Nav2's maps come from SLAM, which draws surfaces only; a map that was rasterised
    from a model is filled, and if the inside counted as near, particles would be drawn into what they look at.
    """
    return DistanceField(grid, surfaces(grid.cells == OCCUPIED), max_distance, walled=False)


def surfaces(solid: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Solid cells (height, width) with a neighbour that is not; what is off the map does not count as one."""
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
        self._hit = _hit(field, z_hit, sigma_hit)

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
    """A particle weighs the product of its beams' probabilities (table 6.3), with optional beam skipping."""

    peak, strays = 1.0, 1.0

    def __init__(
        self, field: DistanceField, z_hit: float, z_rand: float, sigma_hit: float, skipping: BeamSkipping | None = None,
        exponent: float = 1.0, beyond: npt.NDArray[np.bool_] | None = None,
    ) -> None:  # fmt: skip
        """`exponent` is that of the product; beams that end `beyond` the map (flat, as the field's table) say nothing.

        They count as SAYS_NOTHING of a hit, for to leave them out would favour places from which more of them do.
        """
        self._field, self._z_rand, self._skipping, self._exponent = field, np.float32(z_rand), skipping, exponent
        self._z_hit, self._sigma_hit, self._beyond = z_hit, sigma_hit, beyond
        self._range_max, self._logarithm = math.nan, field.table
        self._exponents: Float32 = np.empty(0, dtype=np.float32)

    def log_likelihood(self, poses: Array, beams: Beams, converged: bool) -> Array:
        """Logarithms (n,) of Π p."""
        kept = self._kept(poses, beams, self._skipping) if self._skipping is not None and converged else slice(None)
        logarithms, counting = self._logarithms(beams.range_max), self._counts(len(beams.ends))[kept]

        def judge(block: Array) -> Array:
            # All cells are in the table; `wrap` spares looking whether they are.
            cells = beams.cells(self._field, block)[:, kept]
            return (logarithms.take(cells, mode="wrap") @ counting).astype(np.float64)

        return by_blocks(judge, poses)

    def _counts(self, beams: int) -> Float32:
        """How much each beam counts: (b,)."""
        if beams != len(self._exponents):
            self._exponents = np.full(beams, self._exponent, dtype=np.float32)
        return self._exponents

    def _logarithms(self, range_max: float) -> Float32:
        """Those of the probability of a beam that ends in each cell of the field."""
        if range_max != self._range_max:
            chance = _hit(self._field, self._z_hit, self._sigma_hit)
            if self._beyond is not None:
                chance[self._beyond] = np.maximum(chance[self._beyond], np.float32(SAYS_NOTHING * self._z_hit))
            chance += self._z_rand / np.float32(range_max)
            with np.errstate(divide="ignore"):
                self._logarithm = np.log(chance, out=chance)
            self._range_max = range_max
        return self._logarithm

    def tempering(self, beams: Beams) -> float:
        """The geometric mean over the beams that hit something."""
        return 1 / max(1, int(np.count_nonzero(beams.ranges < beams.range_max))) / self._exponent

    def _kept(self, poses: Array, beams: Beams, skipping: BeamSkipping) -> npt.NDArray[np.bool_] | slice:
        near = self._field.table.take(beams.cells(self._field, poses)) < skipping.distance
        explained: npt.NDArray[np.bool_] = near.mean(axis=0) > skipping.threshold
        misfit = np.count_nonzero(~explained) >= len(explained) * skipping.error_threshold
        return slice(None) if misfit else explained


def _hit(field: DistanceField, z_hit: float, sigma_hit: float) -> Float32:
    """The part of a beam's probability that its end decides, for each cell of the field."""
    return field.told(lambda d: np.float32(z_hit) * np.exp(np.square(d) / np.float32(-2 * sigma_hit**2)), np.float32)
