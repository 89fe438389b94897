"""Beam sensor model: likelihood of a scan by ray casting.

The beam model of Thrun, Burgard & Fox, Probabilistic Robotics, section 6.3 and table 6.1, as in nav2_amcl's
beam_model.cpp. Rays are marched through the distance field, as in Walsh & Karaman, CDDT: Fast Approximate 2D Ray
Casting for Accelerated Localization (ICRA 2018), section II.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simscen.core.environment.occupancy_grid import FREE, OccupancyGrid
from simscen.core.geometry import Array
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.distance_field import DistanceField, evaluate_in_blocks
from simscen.stack.localizers.likelihood_field import MAX_RANDOM_SHARE_OF_SUMS, PEAK_POWER_OF_SUMS


def opaque_field(grid: OccupancyGrid, max_distance: float) -> DistanceField:
    """Return distances to opaque cells: occupied, unknown, and outside the map, as in nav2_amcl."""
    return DistanceField(grid, grid.cells != FREE, max_distance, walled=True)


def cast_rays(field: DistanceField, poses: Array, beams: Beams) -> Array:
    """Return the ranges (n, b) in m that `beams` would measure at `poses` (n, 3), to within half a cell."""
    positions, heading = (values.astype(np.float64)[..., None] for values in field.coordinates(poses))
    forward, left, c, s = beams.origin.real, beams.origin.imag, np.cos(heading), np.sin(heading)
    angle, cell = heading + beams.bearings, field.resolution
    x = np.broadcast_to(positions[0] + (forward * c - left * s) / cell, angle.shape).ravel()
    y = np.broadcast_to(positions[1] + (forward * s + left * c) / cell, angle.shape).ravel()
    traveled = _march(field, x, y, angle.ravel(), beams.range_max / cell)
    ranges: Array = traveled.reshape(angle.shape) * cell
    return ranges


def _march(field: DistanceField, x: Array, y: Array, angle: Array, limit: float) -> Array:
    """Return the free lengths of rays (r,) from x, y along `angle`, at most `limit`; all lengths in cells."""
    cos, sin, traveled, active = np.cos(angle), np.sin(angle), np.zeros_like(x), np.arange(x.size)
    while active.size:
        column = (x[active] + cos[active] * traveled[active]).astype(np.float32)
        row = (y[active] + sin[active] * traveled[active]).astype(np.float32)
        free = field.table.take(field.cells(column, row)) / field.resolution
        active, free = active[free > 0], free[free > 0]
        # Distances are between centers: both the ray and the obstacle may be half a diagonal nearer.
        traveled[active] += np.maximum(free - np.sqrt(2), 0.5)
        active = active[traveled[active] < limit]
    return np.minimum(traveled, limit)


@dataclass(frozen=True, eq=False)
class BeamModel:
    """Mixture of hit, short, maximum, and random ranges for each beam; a particle weighs 1 + Σ p³ over its beams."""

    peak_power: ClassVar[float] = PEAK_POWER_OF_SUMS
    max_random_share: ClassVar[float] = MAX_RANDOM_SHARE_OF_SUMS

    field: DistanceField
    z_hit: float
    z_short: float
    z_max: float
    z_rand: float
    sigma_hit: float
    lambda_short: float

    def log_likelihood(self, poses: Array, beams: Beams, converged: bool) -> Array:
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

    def tempering(self, beams: Beams) -> float:
        """Return 1: a sum of cubes has the same scale for any number of beams."""
        return 1.0
