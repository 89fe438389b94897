"""When what a script moves may meet what can be pushed: until then both can be left alone.

Bullet does not wake what a body without mass meets. So nothing that can be pushed may sleep where a scripted body
comes; elsewhere it may, which spares nearly all that it costs. Whatever else touches it wakes it in the engine, and
with it all that it is in touch with (Bullet's islands).
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose3, Vector
from simscen.sim.bullet import engine
from simscen.sim.objects.actor import Actor

HORIZON_S = 0.1
"""Seconds for which bounds on speeds hold: those of what may fall, or be hit, meanwhile."""
NEAR_CONTACT_S = 0.05
"""Seconds within which a meeting is near: what may be met is awake by then, and every tick is stepped with care."""
SHAPE_MARGIN_M = 0.05
"""m that shapes may extend further than their corners, which is where sizes come from."""


class BoundingDiscs(NamedTuple):
    """Bodies seen from above: each within its radius (n,) in m of its place (n, 2), at most so fast, in m/s."""

    places: Array
    radii: Array
    speeds: Array

    @classmethod
    def of(cls, balls: Iterable[tuple[Vector, float, float]]) -> "BoundingDiscs":
        """From place in space, radius and speed of each."""
        each = list(balls)
        places, radii, speeds = zip(*each, strict=True) if each else ((), (), ())
        return cls(np.array(places).reshape(-1, 3)[:, :2], np.array(radii), np.array(speeds))


class CollisionCandidates(NamedTuple):
    """Who may meet within `seconds`: the numbers of the scripted ones, and of those that can be pushed.

    Where nobody may meet soon, nobody can within `seconds`.
    """

    scripted: tuple[int, ...]
    pushable: tuple[int, ...]
    seconds: float


def find_candidates(scripted: BoundingDiscs, pushable: BoundingDiscs, hit: float) -> CollisionCandidates:
    """Who may meet soon; what can be pushed may get to `hit` m/s within the horizon, for something may hit it."""
    apart = np.linalg.norm(scripted.places[:, np.newaxis] - pushable.places, axis=2)
    gaps = apart - scripted.radii[:, np.newaxis] - pushable.radii - 2 * SHAPE_MARGIN_M
    closing = scripted.speeds[:, np.newaxis] + np.maximum(pushable.speeds, hit)
    near = gaps < NEAR_CONTACT_S * closing
    if near.any():
        return CollisionCandidates(_numbers(near.any(axis=1)), _numbers(near.any(axis=0)), NEAR_CONTACT_S)
    return CollisionCandidates((), (), min(HORIZON_S, float((gaps / closing).min(initial=math.inf))))


def _numbers(chosen: npt.NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(chosen.nonzero()[0].tolist())


# Scripted objects that may push something soon. Wake what they may push before contact.
class BroadPhase:
    """Of scripted things and those that can be pushed; make another one when one comes or goes."""

    def __init__(self, client: int, rate: int, travelling: Sequence[Actor], pushable: Sequence[Actor]) -> None:
        self._client, self._rate, self._travelling, self._pushable = client, rate, travelling, pushable
        self._lying: BoundingDiscs | None = None
        self._shaken_at = -1
        self.until = -1
        """The tick until which nobody else than these can push anything."""
        self.scripted: list[Actor] = []
        """Those that may push something soon."""

    def shaken(self, tick: int) -> None:
        """Something is pushed during the step from `tick` on: how fast things are now says nothing about it."""
        self.until, self._shaken_at = -1, tick

    def look(self, tick: int, robots: float, poses: Mapping[str, Pose3], asleep: bool) -> bool:
        """See who may meet: whether any that can be pushed was woken for that.

        All are put where they are, for until the next look nobody may run into what has gone. `robots` is how fast any
        robot may be for a while, in m/s; `asleep`: all that can be pushed has long been lying.
        """
        moving = list[Actor]()
        for actor in self._travelling:
            actor.show(self._client, poses[actor.body.name])
            if not actor.parked((tick - actor.since) / self._rate, HORIZON_S):
                moving.append(actor)
        if self._lying is None or not asleep:
            self._lying = BoundingDiscs.of(
                (poses[a.body.name][:3], a.size, a.fastest(self._client)) for a in self._pushable
            )
        scripted = BoundingDiscs.of((poses[a.body.name][:3], a.radius, a.speed) for a in moving)  # upright, all of them
        fastest = max(actor.speed for actor in self._travelling)
        # What is hit by something heavier leaves with up to twice its speed.
        found = find_candidates(scripted, self._lying, 2 * max(robots, fastest, float(self._lying.speeds.max())))
        self.scripted = [moving[number] for number in found.scripted]
        for number in found.pushable:
            engine.wake(self._client, self._pushable[number].id)
        self.until = tick + (1 if tick == self._shaken_at else max(1, math.floor(found.seconds * self._rate)))
        return bool(found.pushable)
