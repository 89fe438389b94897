"""Behaviors, each of which breaks a promise."""

import random
from typing import Any

from simscen.core.geometry.kinematics import Twist
from simscen.model.recovery import BackUp, Spin
from simscen.stack.protocols import NavigationFailure
from tests.contracts.broken.cases import Wrapper, breaks

SPIN, BACKUP = Spin(), BackUp()


class CommandWrapper(Wrapper):
    def step(self, pose, costmap, seconds):
        return self.change(self.inner.step(pose, costmap, seconds), seconds)

    def change(self, command: Any, seconds: float) -> Any:
        return command


@breaks(SPIN, "it ends", "has not ended after 120 s")
class NeverEnds(Wrapper):
    def step(self, pose, costmap, seconds):
        return Twist()


@breaks(SPIN, "it ends", "beyond the limits of the base")
class ExceedsSpeedLimit(CommandWrapper):
    def change(self, command, seconds):
        return command and command._replace(wz=5.0)


@breaks(SPIN, "it has a name", "is called ''")
class HasNoName(Wrapper):
    name = ""


@breaks(BACKUP, "it never drives into anything", "drives into a wall")
class IgnoresObstacles(Wrapper):
    def step(self, pose, costmap, seconds):
        return Twist(-0.15) if seconds < 3.0 else None


@breaks(BACKUP, "it never drives into anything", "raises RuntimeError")
class RaisesRuntimeError(Wrapper):
    def step(self, *arguments):
        try:
            return self.inner.step(*arguments)
        except NavigationFailure as failure:
            raise RuntimeError("no free space") from failure


@breaks(BACKUP, "the same calls", "two runs with the same seed differ")
class UsesGlobalRandom(CommandWrapper):
    def change(self, command, seconds):
        return command and command._replace(vx=command.vx * (0.9 + 0.1 * random.random()))


@breaks(BACKUP, "a costmap is not changed", "changes the costmap")
class ChangesCostmap(Wrapper):
    def step(self, pose, costmap, seconds):
        costmap.costs[:] = 0
        return self.inner.step(pose, costmap, seconds)
