"""Selects the actors that a robot can see or touch, so that the others cost no computing time."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array, Pose3, Vector
from simscen.sim.objects.actor import Actor

EXTRA_RADIUS_M = 2.0
"""m farther than was asked for within which things are looked for, so that the others need not be looked at soon."""


class NearbyActors(NamedTuple):
    """The actors that at a tick were within a distance in meters of a place, and all that may be pushed unless asleep.

    `asleep` is since when all of those have been lying still; None where they have not. `lying` are each, its place
    on the ground and its width, where none of these moves.
    """

    actors: tuple[Actor, ...]
    place: Vector
    distance: float
    tick: int
    asleep: int | None
    lying: tuple[tuple[Actor, tuple[float, float], float], ...] | None

    def holds(self, place: Vector, distance: float, tick: int, step: float) -> bool:
        """Whether no other can be within a distance of a place at a tick, moving `step` meters a tick at most."""
        return math.dist(place, self.place) + step * (tick - self.tick) + distance <= self.distance

    def near(self, client: int, place: Vector, distance: float, level: float, poses: Mapping[str, Pose3]) -> list[int]:
        """The engine's numbers of those that may be as near to a place as a distance, being where `poses` has them.

        `level` is enough of it along the ground; what stands has neighbors nearer than it is high.
        A scripted one is put there if that is so near, or where the engine has had it until now.
        """
        if self.lying is not None:
            return [actor.id for actor, there, width in self.lying if math.dist(there, place[:2]) <= level + width]
        near = list[int]()
        for actor in self.actors:
            pose, reach = poses[actor.body.name], distance + actor.size
            if actor.path is not None and actor.away(place, pose) <= reach:
                actor.show(client, pose)
            if math.dist(pose[:3], place) <= reach:
                near.append(actor.id)
        return near

    def gap(self, place: Vector, poses: Mapping[str, Pose3], come_in: float) -> float:
        """How far from a place anybody is at least, now that any may have come in so far since it was looked."""
        gap = self.distance - math.dist(place, self.place) - come_in
        return min([gap, *(actor.away(place, poses[actor.body.name]) - actor.size for actor in self.actors)])


def find_nearby(
    actors: Iterable[Actor], poses: Mapping[str, Pose3], place: Vector, distance: float, tick: int, asleep: int | None
) -> NearbyActors:
    """Those about a place within a distance in meters of what anybody will ask."""
    distance += EXTRA_RADIUS_M
    about = tuple(
        actor
        for actor in actors
        if (asleep is None and actor.pushable) or actor.away(place, poses[actor.body.name]) <= distance + actor.size
    )
    lying = None
    if not any(actor.path is not None or (asleep is None and actor.pushable) for actor in about):
        placed = ((actor, poses[actor.body.name]) for actor in about)
        lying = tuple((actor, pose[:2], actor.width(pose)) for actor, pose in placed)
    return NearbyActors(about, place, distance, tick, asleep, lying)


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
