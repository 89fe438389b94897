"""Behaviors that break a promise each."""

import random
from typing import Any

from simscen.core.geometry.kinematics import Twist
from simscen.model.recovery import BackUp, Spin
from simscen.stack.protocols import NavigationFailure
from tests.contracts.broken.cases import Wrapper, breaks

SPIN, BACKUP = Spin(), BackUp()


class Stepping(Wrapper):
    def step(self, pose, costmap, seconds):
        return self.changed(self.inner.step(pose, costmap, seconds), seconds)

    def changed(self, command: Any, seconds: float) -> Any:
        return command


@breaks(SPIN, "it ends", "has not ended after 120 s")
class WaitsForEver(Wrapper):
    def step(self, pose, costmap, seconds):
        return Twist()


@breaks(SPIN, "it ends", "beyond the limits of the base")
class SpinsTooFast(Stepping):
    def changed(self, command, seconds):
        return command and command._replace(wz=5.0)


@breaks(SPIN, "it has a name", "is called ''")
class IsNameless(Wrapper):
    name = ""


@breaks(BACKUP, "it never drives into anything", "drives into a wall")
class BacksBlindly(Wrapper):
    def step(self, pose, costmap, seconds):
        return Twist(-0.15) if seconds < 3.0 else None


@breaks(BACKUP, "it never drives into anything", "raises RuntimeError")
class FailsInItsOwnWay(Wrapper):
    def step(self, *asked):
        try:
            return self.inner.step(*asked)
        except NavigationFailure as failure:
            raise RuntimeError("no room") from failure


@breaks(BACKUP, "the same calls", "two runs with the same generator differ")
class BacksByChance(Stepping):
    def changed(self, command, seconds):
        return command and command._replace(vx=command.vx * (0.9 + 0.1 * random.random()))


@breaks(BACKUP, "a costmap is not changed", "changes the costmap")
class ClearsTheCostmapItself(Wrapper):
    def step(self, pose, costmap, seconds):
        costmap.costs[:] = 0
        return self.inner.step(pose, costmap, seconds)
