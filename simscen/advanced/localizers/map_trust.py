"""How much a map is worth where the robot is: rooms are rebuilt, furniture is moved, and nobody draws it anew."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.stack.localizers.beams import Beams, Cells, Plane
from simscen.stack.localizers.distance_field import BLOCK, DistanceField
from simscen.stack.localizers.particles import Particles

NEAR = 0.3
"""m: a beam fits that ends this near to what the map shows."""
TOGETHER = 1.0
"""m: particles all within this of their mean know where they are; others are not asked what fits."""
ASKED = 50
"""Particles."""
TELLING = 0.1, 0.8
"""Shares of the beams that end where the map says anything: up to the first a scan counts for nothing, from the second
on in full. A few beams that reach back over the end of a map fit a wall of it from many places."""
MOSTLY = 0.5
"""Share of the particles."""
_NOTHING, _FITS, _FITS_NOT = 0, 1, 2
"""What the map says of a beam that ends in a cell."""


class Worth(NamedTuple):
    """The `exponent` of a scan's likelihood, 0 … 1; the share of its beams that are `fitting`, of those that end where
    the map says anything; and which of them count (b,), None for all."""

    exponent: float
    fitting: float
    counting: npt.NDArray[np.bool_] | None


class MapTrust:
    """The exponent of a scan's likelihood: small where the map does not show what is seen.

    Particles that are one narrow group are right about where they are, or the whole map must be searched; then beams
    that do not fit are the map's fault, and those that do may fit by chance and pull the group astray. Particles that
    spread where there is no map are led astray by the first beams that touch it, so what nothing tells of never counts.
    """

    def __init__(self, field: DistanceField, beyond: npt.NDArray[np.bool_], none: float, full: float) -> None:
        """`beyond` (flat, as the field's table) are the places of which the map says nothing.

        A scan counts for nothing up to the share `none` of beams that fit, and in full from the share `full` on.
        """
        self._field, self._none, self._full = field, none, full
        self._says = np.where(beyond, _NOTHING, np.where(field.table < NEAR, _FITS, _FITS_NOT)).astype(np.uint8)

    def of(self, particles: Particles, beams: Beams) -> Worth:
        """What the ends of beams are worth.

        Of a narrow group each beam counts that ends where the map says something for most
        particles: what it has in unknown space, less than a hit and more than a miss, draws them into the map or out.
        """
        said = self._said(self._seen(particles.poses, beams))
        told, fitting = _told(said)
        exponent = _between(told, *TELLING)
        if not particles.within(TOGETHER):
            return Worth(exponent, fitting, None)
        counting = None if told == 1.0 else np.add.reduce(said != _NOTHING, axis=0) > MOSTLY * len(said)
        return Worth(exponent * _between(fitting, self._none, self._full), fitting, counting)

    def fit(self, poses: Array, ends: Plane, telling: float) -> float | None:
        """The share of the beams that fit at `poses` (n, 3), of those that end where the map says anything.

        None when these are less than the share `telling`.
        """
        told, fitting = _told(self._said(self._field.cells_seen(poses, ends)))
        return fitting if told and told >= telling else None

    def _seen(self, poses: Array, beams: Beams) -> Cells:
        """Where the beams end at some of `poses`; of few, that is known at all of them in a moment anyway."""
        step = -(-len(poses) // ASKED)
        if len(poses) <= BLOCK:
            return beams.cells(self._field, poses)[::step]
        return self._field.cells_seen(poses[::step], beams.ends)

    def _said(self, cells: Cells) -> npt.NDArray[np.uint8]:
        """What the map says of what ends in these cells."""
        said: npt.NDArray[np.uint8] = self._says.take(cells, mode="wrap")
        return said


def _told(said: npt.NDArray[np.uint8]) -> tuple[float, float]:
    """The share of the beams that end where the map says anything, and the share of those that fit."""
    told, fit = int(np.count_nonzero(said)), int(np.count_nonzero(said == _FITS))
    return told / max(said.size, 1), fit / max(told, 1)


def _between(value: float, none: float, full: float) -> float:
    """0 up to `none`, 1 from `full` on, in between in proportion."""
    return 1.0 if value >= full else max(0.0, (value - none) / (full - none))
