"""Which of the things that move are about a place."""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from simscen.core.geometry import Pose3
from simscen.sim.objects.actor import Actor, Vector

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
