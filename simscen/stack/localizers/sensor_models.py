"""Sensor models of nav2_amcl: likelihood of a scan by distances to obstacles (likelihood field) or by ray casting.

Likelihood fields: Thrun, Burgard & Fox, Probabilistic Robotics, section 6.4 and table 6.3; nav2_amcl's
likelihood_field_model.cpp and likelihood_field_model_prob.cpp. Beams that hit nothing are ignored.

Beam model: Probabilistic Robotics, section 6.3 and table 6.1; nav2_amcl's beam_model.cpp. Ray casting: Walsh & Karaman,
CDDT: Fast Approximate 2D Ray Casting for Accelerated Localization (ICRA 2018), section II.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.distance_field import DistanceField, Float32, evaluate_in_blocks

PEAK_POWER_OF_SUMS = 16.0
"""`peak_power` of models with the weight 1 + Σ p³. This weight differs little between good and bad particles."""
MAX_RANDOM_FRACTION_OF_SUMS = 0.05
"""`max_random_fraction` of models with the weight 1 + Σ p³. With this weight, random particles survive many scans."""


class SensorModel(Protocol):
    """Computes the likelihood of a scan at the poses of particles."""

    @property
    def peak_power(self) -> float:
        """Power to which the pose estimate raises weights, to emphasize the best particles; 1 has no effect."""
        ...

    @property
    def max_random_fraction(self) -> float:
        """Maximum fraction of random particles that Augmented MCL may add with each scan."""
        ...

    def log_likelihood(self, poses: Array, beams: Beams, has_converged: bool) -> Array:
        """Return the log likelihoods (n,) of the beams at each of the `poses` (n, 3); -inf if impossible, never nan.

        `has_converged`: the particles are one narrow cluster, so that beam skipping is allowed.
        """
        ...

    def tempering_exponent(self, beams: Beams) -> float:
        """Return an exponent that makes likelihoods of scans with different numbers of beams comparable."""
        ...


def obstacle_field(grid: OccupancyGrid, max_distance: float) -> DistanceField:
    """Return distances to the surfaces of occupied areas, at most `max_distance` m.

    Outside the map, the distance is `max_distance`, as in nav2_amcl. Cells inside walls are not obstacles, because no
    beam can end there.
    """
    return DistanceField(grid, surfaces(grid.cells == OCCUPIED), max_distance, walled=False)


def surfaces(solid: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return which of the `solid` cells (height, width) have a neighbor on the map that is not solid."""
    padded = np.pad(solid, 1, constant_values=True)
    inside = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return solid & ~inside


class LikelihoodField:
    """Default model of nav2_amcl: the weight of a particle is 1 + Σ p³ over the likelihoods p of its beams.

    This model tolerates beams that hit obstacles that are not on the map.
    """

    peak_power, max_random_fraction = PEAK_POWER_OF_SUMS, MAX_RANDOM_FRACTION_OF_SUMS

    def __init__(self, field: DistanceField, z_hit: float, z_rand: float, sigma_hit: float) -> None:
        self._field, self._z_rand = field, np.float32(z_rand)
        self._hit = _hit_likelihoods(field, z_hit, sigma_hit)

    def log_likelihood(self, poses: Array, beams: Beams, has_converged: bool) -> Array:
        """Return the logarithms (n,) of 1 + Σ p³."""
        z_rand = self._z_rand / np.float32(beams.range_max)

        def weigh(block: Array) -> Array:
            p = self._hit.take(beams.cells(self._field, block))
            p += z_rand
            logarithm: Array = np.log1p(np.sum(p * p * p, axis=1, dtype=np.float64))
            return logarithm

        return evaluate_in_blocks(weigh, poses)

    def tempering_exponent(self, beams: Beams) -> float:
        """Return 1: log(1 + Σ p³) grows only slowly with the number of beams."""
        return 1.0


@dataclass(frozen=True)
class BeamSkipping:
    """Parameters of beam skipping, which ignores beams that hit people or other obstacles that are not on the map.

    A beam fits a particle if the beam ends less than `distance` m from an obstacle of the map. A beam is skipped if it
    fits at most the fraction `threshold` of the particles. If at least the fraction `error_threshold` of the beams
    would be skipped, the pose is assumed to be wrong, and no beam is skipped.
    """

    distance: float
    threshold: float
    error_threshold: float


class LikelihoodFieldProb:
    """Model in which the weight of a particle is the product of the likelihoods of its beams (table 6.3).

    Subclasses may set `exponent` and override `_hit_likelihoods`.
    """

    peak_power, max_random_fraction = 1.0, 1.0
    exponent = 1.0
    """Power to which the product is raised."""

    def __init__(
        self, field: DistanceField, z_hit: float, z_rand: float, sigma_hit: float, skipping: BeamSkipping | None = None
    ) -> None:  # fmt: skip
        self._field, self._z_rand, self._skipping = field, np.float32(z_rand), skipping
        self._z_hit, self._sigma_hit = z_hit, sigma_hit
        self._range_max, self._logarithm = math.nan, field.table
        self._exponents: Float32 = np.empty(0, dtype=np.float32)

    def log_likelihood(self, poses: Array, beams: Beams, has_converged: bool) -> Array:
        """Return the logarithms (n,) of the products."""
        used_beams: npt.NDArray[np.bool_] | slice = slice(None)
        if self._skipping is not None and has_converged:
            used_beams = self._used_beams(poses, beams, self._skipping)
        logarithms, exponents = self._logarithms(beams.range_max), self._beam_exponents(len(beams.ends))[used_beams]

        def weigh(block: Array) -> Array:
            cells = beams.cells(self._field, block)[:, used_beams]
            # All indices are valid; mode="wrap" skips the check.
            return (logarithms.take(cells, mode="wrap") @ exponents).astype(np.float64)

        return evaluate_in_blocks(weigh, poses)

    def tempering_exponent(self, beams: Beams) -> float:
        """Return the exponent that turns the product into a geometric mean over the beams that hit something."""
        return 1 / max(1, int(np.count_nonzero(beams.ranges < beams.range_max))) / self.exponent

    def _beam_exponents(self, count: int) -> Float32:
        """Return an array (count,) filled with `exponent`."""
        if count != len(self._exponents):
            self._exponents = np.full(count, self.exponent, dtype=np.float32)
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
        """Return the likelihood of a hit for each cell, without the part of random ranges."""
        return _hit_likelihoods(self._field, self._z_hit, self._sigma_hit)

    def _used_beams(self, poses: Array, beams: Beams, skipping: BeamSkipping) -> npt.NDArray[np.bool_] | slice:
        """Return which beams (m,) are not skipped; a slice for all beams."""
        fits = self._field.table.take(beams.cells(self._field, poses)) < skipping.distance
        is_used: npt.NDArray[np.bool_] = fits.mean(axis=0) > skipping.threshold
        is_pose_wrong = np.count_nonzero(~is_used) >= len(is_used) * skipping.error_threshold
        return slice(None) if is_pose_wrong else is_used


def _hit_likelihoods(field: DistanceField, z_hit: float, sigma_hit: float) -> Float32:
    """Return z_hit · exp(-d² / 2σ²) for the distance d of each cell from the nearest obstacle."""
    return field.tabulate(
        lambda d: np.float32(z_hit) * np.exp(np.square(d) / np.float32(-2 * sigma_hit**2)), np.float32
    )


def opaque_field(grid: OccupancyGrid, max_distance: float) -> DistanceField:
    """Return distances to opaque cells: occupied, unknown, and outside the map, as in nav2_amcl."""
    return DistanceField(grid, grid.cells != FREE, max_distance, walled=True)


def cast_rays(field: DistanceField, poses: Array, beams: Beams) -> Array:
    """Return the ranges (n, b) in m of `beams` at `poses` (n, 3), with errors up to half a cell."""
    positions, heading = (values.astype(np.float64)[..., None] for values in field.coordinates(poses))
    forward, left, c, s = beams.origin.real, beams.origin.imag, np.cos(heading), np.sin(heading)
    angle, cell = heading + beams.bearings, field.resolution
    x = np.broadcast_to(positions[0] + (forward * c - left * s) / cell, angle.shape).ravel()
    y = np.broadcast_to(positions[1] + (forward * s + left * c) / cell, angle.shape).ravel()
    traveled = _march(field, x, y, angle.ravel(), beams.range_max / cell)
    ranges: Array = traveled.reshape(angle.shape) * cell
    return ranges


def _march(field: DistanceField, x: Array, y: Array, angle: Array, limit: float) -> Array:
    """Return the free lengths (r,) of rays from x, y (r,) along `angle` (r,), at most `limit`. The unit is cells."""
    cos, sin, traveled, active = np.cos(angle), np.sin(angle), np.zeros_like(x), np.arange(x.size)
    while active.size:
        column = (x[active] + cos[active] * traveled[active]).astype(np.float32)
        row = (y[active] + sin[active] * traveled[active]).astype(np.float32)
        free = field.table.take(field.cells(column, row)) / field.resolution
        active, free = active[free > 0], free[free > 0]
        # Distances are between cell centers. The ray and the edge of the obstacle may each be half a diagonal nearer.
        traveled[active] += np.maximum(free - np.sqrt(2), 0.5)
        active = active[traveled[active] < limit]
    return np.minimum(traveled, limit)


@dataclass(frozen=True, eq=False)
class BeamModel:
    """Model with ray casting, in which the weight of a particle is 1 + Σ p³ over the likelihoods p of its beams.

    The likelihood is a mixture of hit, short, maximum, and random ranges, with the weights z_hit, z_short, z_max, and
    z_rand.
    """

    peak_power: ClassVar[float] = PEAK_POWER_OF_SUMS
    max_random_fraction: ClassVar[float] = MAX_RANDOM_FRACTION_OF_SUMS

    field: DistanceField
    z_hit: float
    z_short: float
    z_max: float
    z_rand: float
    sigma_hit: float
    lambda_short: float

    def log_likelihood(self, poses: Array, beams: Beams, has_converged: bool) -> Array:
        """Return the logarithms (n,) of 1 + Σ p³."""
        missed = beams.ranges >= beams.range_max

        def weigh(block: Array) -> Array:
            error = beams.ranges - cast_rays(self.field, block, beams)
            p = self.z_hit * np.exp(np.square(error) / (-2 * self.sigma_hit**2))
            p += (error < 0) * (self.z_short * self.lambda_short * np.exp(-self.lambda_short * beams.ranges))
            p += np.where(missed, self.z_max, self.z_rand / beams.range_max)
            logarithm: Array = np.log1p((p * p * p).sum(axis=1))
            return logarithm

        return evaluate_in_blocks(weigh, poses)

    def tempering_exponent(self, beams: Beams) -> float:
        """Return 1: log(1 + Σ p³) grows only slowly with the number of beams."""
        return 1.0
