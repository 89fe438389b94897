"""Broad phase for scripted and pushable actors: finds pairs that may touch soon, and wakes the pushable actors.

Pushable actors at rest sleep in the engine, which saves computing time. Bullet does not wake a sleeping body when a
scripted actor (an actor without mass that follows a path) reaches it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose3, Vector
from simscen.sim.bullet import engine
from simscen.sim.objects.actor import SHAPE_MARGIN_M, SPEED_HORIZON_S, Actor

NEAR_CONTACT_S = 0.05
"""Time to collision below which pushable objects are woken."""


class BoundingDiscs(NamedTuple):
    """Bounding discs of bodies, seen from above: centers (n, 2) and radii (n,) in m, maximum speeds (n,) in m/s."""

    centers: Array
    radii: Array
    speeds: Array

    @classmethod
    def of(cls, spheres: Iterable[tuple[Vector, float, float]]) -> "BoundingDiscs":
        """Return the discs of bounding spheres, given as tuples (center, radius, maximum speed)."""
        rows = list(spheres)
        centers, radii, speeds = zip(*rows, strict=True) if rows else ((), (), ())
        return cls(np.array(centers).reshape(-1, 3)[:, :2], np.array(radii), np.array(speeds))


class CollisionCandidates(NamedTuple):
    """Indices of the scripted and pushable bodies that may touch soon. No other pair can touch within `seconds`."""

    scripted: tuple[int, ...]
    pushable: tuple[int, ...]
    seconds: float


def find_candidates(scripted: BoundingDiscs, pushable: BoundingDiscs, hit_speed: float) -> CollisionCandidates:
    """Return the scripted and pushable bodies that may touch each other within NEAR_CONTACT_S.

    `hit_speed` is an upper bound in m/s of the speed of a pushable body after another body has hit it.
    """
    distances = np.linalg.norm(scripted.centers[:, np.newaxis] - pushable.centers, axis=2)
    gaps = distances - scripted.radii[:, np.newaxis] - pushable.radii - 2 * SHAPE_MARGIN_M
    closing_speeds = scripted.speeds[:, np.newaxis] + np.maximum(pushable.speeds, hit_speed)
    is_near = gaps < NEAR_CONTACT_S * closing_speeds
    if is_near.any():
        return CollisionCandidates(_indices(is_near.any(axis=1)), _indices(is_near.any(axis=0)), NEAR_CONTACT_S)
    return CollisionCandidates((), (), min(SPEED_HORIZON_S, float((gaps / closing_speeds).min(initial=math.inf))))


def _indices(mask: npt.NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(mask.nonzero()[0].tolist())


class BroadPhase:
    """Finds scripted and pushable actors (movable objects) that may touch soon, and wakes the pushable actors.

    Create a new instance when actors are added or removed.
    """

    def __init__(self, client: int, tick_rate: int, scripted: Sequence[Actor], pushable: Sequence[Actor]) -> None:
        self._client, self._tick_rate, self._scripted, self._pushable = client, tick_rate, scripted, pushable
        self._pushable_discs: BoundingDiscs | None = None
        self._push_tick = -1
        self.valid_until = -1
        """Tick until which no scripted actors except `near_contact` can push anything."""
        self.near_contact: list[Actor] = []
        """Scripted actors that may push something before `valid_until`."""

    def invalidate(self, tick: int) -> None:
        """Discard the result, because something is pushed during the step that begins at `tick`."""
        self.valid_until, self._push_tick = -1, tick

    def update(self, tick: int, robot_speed: float, poses: Mapping[str, Pose3], are_pushable_asleep: bool) -> bool:
        """Wake the pushable actors that a scripted actor may touch soon; return whether there are such actors.

        Also sets the poses of all scripted actors in the engine. `robot_speed` is an upper bound in m/s of the speed of
        all robots. `are_pushable_asleep` states whether all pushable actors sleep.
        """
        moving = list[Actor]()
        for actor in self._scripted:
            actor.set_engine_pose(self._client, poses[actor.body.name])
            if not actor.is_parked((tick - actor.path_start_tick) / self._tick_rate, SPEED_HORIZON_S):
                moving.append(actor)
        if self._pushable_discs is None or not are_pushable_asleep:
            self._pushable_discs = BoundingDiscs.of(
                (poses[a.body.name][:3], a.bounding_radius, a.speed_bound(self._client)) for a in self._pushable
            )
        # Scripted actors are upright, so that their horizontal radius is sufficient.
        scripted_discs = BoundingDiscs.of((poses[a.body.name][:3], a.cylinder_radius, a.max_speed) for a in moving)
        scripted_speed = max(actor.max_speed for actor in self._scripted)
        # A body that is hit by a heavier one leaves with up to twice its speed.
        hit_speed = 2 * max(robot_speed, scripted_speed, float(self._pushable_discs.speeds.max()))
        found = find_candidates(scripted_discs, self._pushable_discs, hit_speed)
        self.near_contact = [moving[index] for index in found.scripted]
        for index in found.pushable:
            engine.wake(self._client, self._pushable[index].id)
        ticks = 1 if tick == self._push_tick else max(1, math.floor(found.seconds * self._tick_rate))
        self.valid_until = tick + ticks
        return bool(found.pushable)
