"""Likelihood field with a tempered product and with beams that carry no information where the map ends."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, UNKNOWN, OccupancyGrid
from simscen.stack.costmap.distance_transform import MAX_REACH_CELLS, squared_distances_within
from simscen.stack.localizers.distance_field import DistanceField, Float32
from simscen.stack.localizers.likelihood_field import BeamSkipping, LikelihoodFieldProb

UNINFORMATIVE_SHARE_OF_HIT = 0.4
"""Likelihood of a beam that ends outside the map, relative to a hit.

About the geometric mean of the likelihoods of all beams of a well localized robot. Leaving such beams out instead would
favor poses from which more beams leave the map.
"""
MAX_WALL_THICKNESS_M = 1.0
"""Unknown space behind a wall that is deeper than this may contain unmapped rooms."""


class TemperedLikelihoodField(LikelihoodFieldProb):
    """`likelihood_field_prob` whose product is raised to a power below 1, because neighboring beams err together."""

    def __init__(
        self, field: DistanceField, z_hit: float, z_rand: float, sigma_hit: float, skipping: BeamSkipping | None = None,
        exponent: float = 1.0, unmapped: npt.NDArray[np.bool_] | None = None,
    ) -> None:  # fmt: skip
        """Create the model. `unmapped` (flat, as the field's table) marks cells where beams carry no information."""
        super().__init__(field, z_hit, z_rand, sigma_hit, skipping)
        self.exponent, self._unmapped = exponent, unmapped

    def _hit_likelihoods(self) -> Float32:
        likelihoods = super()._hit_likelihoods()
        if self._unmapped is not None:
            floor = np.float32(UNINFORMATIVE_SHARE_OF_HIT * self._z_hit)
            likelihoods[self._unmapped] = np.maximum(likelihoods[self._unmapped], floor)
        return likelihoods


def beyond_the_map(grid: OccupancyGrid) -> npt.NDArray[np.bool_]:
    """Return the unknown cells, with a border of one cell, in which a beam may end without the map's knowledge.

    These are the unknown cells whose nearest known cell is free, and those deeper than MAX_WALL_THICKNESS_M behind a
    wall. No beam reaches other unknown cells, since a wall stops it.
    """
    unknown = np.pad(grid.cells == UNKNOWN, 1, constant_values=True)
    if unknown.all():
        return unknown
    border_only = np.count_nonzero(unknown) == unknown.size - grid.cells.size
    if border_only and math.sqrt(2) * grid.resolution <= MAX_WALL_THICKNESS_M:
        next_to_free: npt.NDArray[np.bool_] = np.pad(grid.cells == FREE, 1, mode="edge")
        return unknown & next_to_free
    reach = min(MAX_REACH_CELLS, math.ceil(MAX_WALL_THICKNESS_M / grid.resolution))
    known = squared_distances_within(~unknown, reach)
    beyond: npt.NDArray[np.bool_] = squared_distances_within(np.pad(grid.cells == FREE, 1), reach) == known
    beyond |= known > (MAX_WALL_THICKNESS_M / grid.resolution) ** 2
    beyond &= unknown
    return beyond
