"""How much a map is worth where the robot is: rooms are rebuilt, furniture is moved, and nobody draws it anew."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.stack.localizers.beams import Plane
from simscen.stack.localizers.distance_field import DistanceField
from simscen.stack.localizers.particles import Particles

NEAR = 0.3
"""m: a beam fits that ends this near to what the map shows."""
TOGETHER = 1.0
"""m: particles all within this of their mean know where they are; others are not asked."""
ASKED = 50
"""Particles."""
TELLING = 0.1
"""Share of the beams that must end where the map says anything, for it to be doubted."""
_NOTHING, _FITS, _FITS_NOT = 0, 1, 2
"""What the map says of a beam that ends in a cell."""


class MapTrust:
    """The exponent of a scan's likelihood: small where the map does not show what is seen.

    Particles that are one narrow group are right about where they are, or the whole map must be searched; then beams
    that do not fit are the map's fault, and those that do may fit by chance and pull the group astray.
    """

    def __init__(self, field: DistanceField, beyond: npt.NDArray[np.bool_], none: float, full: float) -> None:
        """`beyond` (flat, as the field's table) are the places of which the map says nothing.

        A scan counts for nothing up to the share `none` of beams that fit, and in full from the share `full` on.
        """
        self._field, self._none, self._full = field, none, full
        self._says = np.where(beyond, _NOTHING, np.where(field.table < NEAR, _FITS, _FITS_NOT)).astype(np.uint8)

    def of(self, particles: Particles, ends: Plane) -> float:
        """The exponent, 0 … 1, for beams that end at `ends` (b,) in the base frame."""
        if not particles.within(TOGETHER):
            return 1.0
        share = self.fit(particles.poses[:: -(-len(particles.poses) // ASKED)], ends, TELLING)
        if share is None or share >= self._full:
            return 1.0
        return max(0.0, (share - self._none) / (self._full - self._none))

    def fit(self, poses: Array, ends: Plane, telling: float) -> float | None:
        """The share of the beams that fit at `poses` (n, 3), of those that end where the map says anything.

        None when these are less than the share `telling`.
        """
        said = self._says.take(self._field.cells_seen(poses, ends), mode="clip").ravel()
        _, fit, fit_not = np.bincount(said, minlength=3).tolist()
        told = fit + fit_not
        return fit / told if told and told >= telling * len(said) else None
