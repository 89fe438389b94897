"""Who of those that a script moves may push something soon; what they may push is awake by then."""

import math
from collections.abc import Mapping, Sequence

from simscen.core.geometry import Pose3
from simscen.sim import engine
from simscen.sim.actor import Actor
from simscen.sim.encounters import HORIZON, Balls, encounters


class Meetings:
    """Of scripted things and those that can be pushed; make another one when one comes or goes."""

    def __init__(self, client: int, rate: int, travelling: Sequence[Actor], pushable: Sequence[Actor]) -> None:
        self._client, self._rate, self._travelling, self._pushable = client, rate, travelling, pushable
        self._lying: Balls | None = None
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
            if not actor.parked((tick - actor.since) / self._rate, HORIZON):
                moving.append(actor)
        if self._lying is None or not asleep:
            self._lying = Balls.of((poses[a.body.name][:3], a.size, a.fastest(self._client)) for a in self._pushable)
        scripted = Balls.of((poses[a.body.name][:3], a.radius, a.speed) for a in moving)  # upright, all of them
        fastest = max(actor.speed for actor in self._travelling)
        # What is hit by something heavier leaves with up to twice its speed.
        found = encounters(scripted, self._lying, 2 * max(robots, fastest, float(self._lying.speeds.max())))
        self.scripted = [moving[number] for number in found.scripted]
        for number in found.pushable:
            engine.wake(self._client, self._pushable[number].id)
        self.until = tick + (1 if tick == self._shaken_at else max(1, math.floor(found.seconds * self._rate)))
        return bool(found.pushable)
