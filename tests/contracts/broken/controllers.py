"""Controllers that break a promise each."""

import math
import random
from typing import Any

from simscen.core.geometry.kinematics import Twist
from simscen.model.controllers import RegulatedPurePursuit
from simscen.stack.protocols import NavigationFailure
from tests.contracts.broken.cases import Wrapper, breaks

CONTROLLER = RegulatedPurePursuit()


class Commanding(Wrapper):
    def command(self, *asked):
        return self.changed(self.inner.command(*asked))

    def changed(self, command: Twist) -> Any:
        return command


@breaks(CONTROLLER, "it follows the path", "from the end of the path")
class StandsStill(Commanding):
    def changed(self, command):
        return Twist()


@breaks(CONTROLLER, "it follows the path", "deviates from the path by")
class Swerves(Commanding):
    k = 0

    def changed(self, command):
        self.k += 1
        return Twist(0.3, 0.0, 0.4) if self.k < 60 else command


@breaks(CONTROLLER, "no command exceeds", "beyond the limits of the base")
class TurnsTooFast(Commanding):
    def changed(self, command):
        return command._replace(wz=9.0)


@breaks(CONTROLLER, "no command exceeds", "beyond the limits of the base")
class SlidesSideways(Commanding):
    def changed(self, command):
        return command._replace(vy=0.1)


@breaks(CONTROLLER, "no command exceeds", "nan")
class CommandsNothings(Commanding):
    def changed(self, command):
        return command._replace(vx=math.nan)


@breaks(CONTROLLER, "a speed limit", "under a limit of 0.15")
class MindsNoLimit(Wrapper):
    def set_speed_limit(self, limit):
        pass


@breaks(CONTROLLER, "a speed limit", "without a limit")
class NeverLiftsALimit(Wrapper):
    def set_speed_limit(self, limit):
        self.inner.set_speed_limit(limit or 0.15)


@breaks(CONTROLLER, "a command is collision free or it fails with no valid control", "with an obstacle")
class IsBlind(Wrapper):
    def command(self, pose, twist, costmap, goal):
        return Twist(0.5, 0.0, 0.0)


@breaks(CONTROLLER, "it never drives into a wall", "drives into the wall")
class DrivesOn(Wrapper):
    def command(self, *asked):
        try:
            return self.inner.command(*asked)
        except NavigationFailure:
            return Twist(0.2, 0.0, 0.0)


@breaks(CONTROLLER, "the same calls", "two drives with the same generator differ")
class Trembles(Commanding):
    def changed(self, command):
        return command._replace(wz=command.wz * (1.0 + 1e-9 * random.random()))


@breaks(CONTROLLER, "an empty path", "accepts a path without points")
class TakesEverything(Wrapper):
    def set_path(self, path):
        if len(path.points):
            self.inner.set_path(path)


@breaks(CONTROLLER, "path and costmap", "changes the path")
class StraightensThePath(Wrapper):
    def set_path(self, path):
        self.inner.set_path(path)
        path.points[:, 1] += 0.01


@breaks(CONTROLLER, "path and costmap", "an old costmap affects a new command")
class KeepsACostmap(Wrapper):
    kept = None

    def command(self, pose, twist, costmap, goal):
        self.kept = self.kept or costmap
        slower = 0.5 if (self.kept.costs == 254).all() else 1.0
        command = self.inner.command(pose, twist, costmap, goal)
        return command._replace(vx=slower * command.vx, wz=slower * command.wz)


@breaks(CONTROLLER, "its local plan", "not a path of finite poses")
class ExpectsPoints(Wrapper):
    local_plan = ((0.0, 0.0), (1.0, 0.0))
