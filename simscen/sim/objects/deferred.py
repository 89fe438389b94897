"""Which of the things that nobody pushes the engine has: those to whose ways a robot has come near.

A body takes 0.16 µs of each step wherever it is, and 0.3 ms to be made; of twenty carts in a warehouse a robot meets
two. A thing that were missing where a robot meets it would be a collision that nobody sees, so nothing here goes by
time or by speeds: it comes in, for good, before a robot is within reach of any place that its script ever leads it to.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array, Vector
from simscen.sim.objects.actor import Actor

REQUERY_DISTANCE_M = 1.0
"""m that a robot may move before it is looked anew whose ways it has come near to."""
ROUNDING_MARGIN_M = 1e-3
"""m by which any distance here may be wrong, which are sums of few numbers."""


class ProximityQuery(NamedTuple):
    """Where a robot is, and how far from there it looks for what moves, in meters."""

    place: Vector
    reach: float


class DeferredActors:
    """Actors that the engine has not got, which stand or follow one path for good."""

    def __init__(self, actors: Sequence[Actor]) -> None:
        self._actors = actors
        rows = np.array([way for actor in actors for way in actor.ways])
        self._owners = np.repeat(np.arange(len(actors)), [len(actor.ways) for actor in actors])
        self._starts, self._along = rows[:, :2], rows[:, 2:4] - rows[:, :2]
        self._squared = np.maximum((self._along**2).sum(axis=1), 1e-12)
        self._wide = rows[:, 4] + np.array([actor.size for actor in actors])[self._owners] + ROUNDING_MARGIN_M
        self._missing = np.ones(len(actors), dtype=np.bool_)

    def met(self, robots: Iterable[ProximityQuery]) -> list[Actor]:
        """Those of them, in their order, that any robot might find within its reach some time; absent no more.

        For as long as each is no more than a stride away from there, those are all.
        """
        met = np.zeros(len(self._actors), dtype=np.bool_)
        for place, reach in robots:
            met[self._owners[self._apart(place) <= reach + REQUERY_DISTANCE_M]] = True
        met &= self._missing
        self._missing &= ~met
        return [self._actors[number] for number in np.flatnonzero(met).tolist()]

    def _apart(self, place: Vector) -> Array:
        """How far a place is from what anybody covers of the ground on any of the ways, in meters, at least."""
        to = np.array(place[:2]) - self._starts
        share = np.clip((to * self._along).sum(axis=1) / self._squared, 0.0, 1.0)
        away: Array = np.linalg.norm(to - share[:, np.newaxis] * self._along, axis=1) - self._wide
        return away
