"""Poses of all actors at the current tick, queried once per tick or computed in advance."""

import math
from collections.abc import Mapping

import numpy as np

from simscen.core.geometry import Pose3
from simscen.core.geometry.scripted_poses import BatchPathSampler, PredictedPoses
from simscen.sim.bullet import engine
from simscen.sim.bullet.divergence import divergence_reason
from simscen.sim.objects.actor import Actor

PRECOMPUTED_S = 4
"""Simulated time for which the poses of scripted actors are computed in one batch."""


class ActorPoses:
    """Poses of actors, and whether the pushable actors are at rest.

    Create a new instance when an actor is added or removed.
    """

    def __init__(
        self, client: int, tick_rate: int, actors: Mapping[str, Actor], no_contact_before: Mapping[int, int]
    ) -> None:
        """Take all actors by name, and the ticks before which the robots cannot touch any actor, by body id."""
        self._client, self._tick_rate, self._actors = client, tick_rate, actors
        self._no_contact_before = no_contact_before
        self._scripted = [actor for actor in actors.values() if actor.path is not None]
        self._pushable = [actor for actor in actors.values() if actor.is_pushable]
        self._poses: Mapping[str, Pose3] = {}
        self._tick: int | None = None
        self.resting_since: int | None = None
        """Tick of the last query at which a pushable actor moved.

        None before the first query, and if a pushable actor may be pushed before the next query.
        """
        self._ticks_until_asleep = math.ceil(2 * engine.SLEEP_DELAY_S * tick_rate)
        self._moved = list(self._pushable)
        """Pushable actors that have moved since the last check for divergence."""
        self._predicted: PredictedPoses | None = None
        self._sampler: BatchPathSampler | None = None

    def at(self, tick: int) -> Mapping[str, Pose3]:
        """Return the poses of all actors at the current `tick`, sorted by name."""
        if self._tick == tick:
            return self._poses
        if self._tick is None or (self._pushable and not self.are_pushable_asleep(tick)):
            self._poses = {name: self._pose(actor, tick) for name, actor in self._actors.items()}
            self._predicted = None
            if self.resting_since is None or not all(actor.is_resting for actor in self._pushable):
                self.resting_since = tick
        elif self._scripted:
            predicted = None if self._predicted is None else self._predicted.at(tick)
            if predicted is not None:
                self._poses = predicted
            else:
                self._poses = {**self._poses, **{a.body.name: self._pose(a, tick) for a in self._scripted}}
        self._tick = tick
        return self._poses

    def _pose(self, actor: Actor, tick: int) -> Pose3:
        if actor.path is not None:
            return actor.path_pose(tick, self._tick_rate)
        if not actor.is_pushable:
            actor.is_resting = True
            return actor.body.pose
        if actor.update_pose(self._client):
            self._moved.append(actor)
        assert actor.center_and_pose is not None
        return actor.center_and_pose[1]

    def invalidate(self) -> None:
        """Let the next call of `at` query all poses again, because an actor was put to sleep."""
        self._tick = None

    def are_pushable_asleep(self, tick: int) -> bool:
        """Return whether all pushable actors sleep in the engine, and no robot can have touched any of them."""
        is_resting = self.resting_since is not None and tick - self.resting_since > self._ticks_until_asleep
        return is_resting and tick <= min(self._no_contact_before.values())

    def prefetch(self, tick: int, period: int) -> None:
        """Precompute the poses of scripted actors every `period` ticks from the current `tick` on, for PRECOMPUTED_S.

        Does nothing if an actor is steered, or if a pushable actor can move.
        """
        if not self._scripted or self._tick is None or (self._pushable and not self.are_pushable_asleep(tick)):
            return
        is_known = self._predicted is not None and tick in self._predicted.ticks
        if is_known or any(actor.is_steered for actor in self._scripted):
            return
        if self._sampler is None:
            paths = [(actor.path, actor.body.pose.z) for actor in self._scripted]
            self._sampler = BatchPathSampler([(path, z) for path, z in paths if path is not None])
        ticks = range(tick, tick + max(1, PRECOMPUTED_S * self._tick_rate // period) * period, period)
        starts = np.array([actor.path_start_tick for actor in self._scripted])
        table = self._sampler.at((np.array(ticks)[:, np.newaxis] - starts) / self._tick_rate)
        names = tuple(actor.body.name for actor in self._scripted)
        self._predicted = PredictedPoses(ticks, names, table, {**self._poses})

    def find_divergence(self, tick: int) -> str | None:
        """Return the reason why the state of an actor that has moved is invalid, or None if all states are valid."""
        self.at(tick)
        moved, self._moved = self._moved, []
        for actor in moved:
            if actor.center_and_pose is not None:
                position, quaternion = actor.center_and_pose[0]
                if reason := divergence_reason(f'object "{actor.body.name}"', *position, sum(quaternion)):
                    return reason
        return None
