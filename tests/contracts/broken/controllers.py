"""Controllers, each of which breaks a promise."""

import math
import random
from typing import Any

from simscen.core.geometry.kinematics import Twist
from simscen.model.controllers import RegulatedPurePursuit
from simscen.stack.protocols import NavigationFailure
from tests.contracts.broken.cases import Wrapper, breaks

CONTROLLER = RegulatedPurePursuit()


class CommandWrapper(Wrapper):
    def command(self, *arguments):
        return self.change(self.inner.command(*arguments))

    def change(self, command: Twist) -> Any:
        return command


@breaks(CONTROLLER, "it follows the path", "from the end of the path")
class NeverMoves(CommandWrapper):
    def change(self, command):
        return Twist()


@breaks(CONTROLLER, "it follows the path", "deviates from the path by")
class LeavesPath(CommandWrapper):
    commands = 0

    def change(self, command):
        self.commands += 1
        return Twist(0.3, 0.0, 0.4) if self.commands < 60 else command


@breaks(CONTROLLER, "no command exceeds", "beyond the limits of the base")
class ExceedsAngularLimit(CommandWrapper):
    def change(self, command):
        return command._replace(wz=9.0)


@breaks(CONTROLLER, "no command exceeds", "beyond the limits of the base")
class CommandsLateralVelocity(CommandWrapper):
    def change(self, command):
        return command._replace(vy=0.1)


@breaks(CONTROLLER, "no command exceeds", "nan")
class CommandsNan(CommandWrapper):
    def change(self, command):
        return command._replace(vx=math.nan)


@breaks(CONTROLLER, "a speed limit", "under a limit of 0.15")
class IgnoresSpeedLimit(Wrapper):
    def set_speed_limit(self, limit):
        pass


@breaks(CONTROLLER, "a speed limit", "without a limit")
class KeepsSpeedLimit(Wrapper):
    def set_speed_limit(self, limit):
        self.inner.set_speed_limit(limit or 0.15)


@breaks(CONTROLLER, "a command is collision free or it fails with no valid control", "with an obstacle")
class IgnoresCostmap(Wrapper):
    def command(self, pose, twist, costmap, goal):
        return Twist(0.5, 0.0, 0.0)


@breaks(CONTROLLER, "it never drives into a wall", "drives into the wall")
class HidesFailure(Wrapper):
    def command(self, *arguments):
        try:
            return self.inner.command(*arguments)
        except NavigationFailure:
            return Twist(0.2, 0.0, 0.0)


@breaks(CONTROLLER, "the same calls", "two drives with the same seed differ")
class UsesGlobalRandom(CommandWrapper):
    def change(self, command):
        return command._replace(wz=command.wz * (1.0 + 1e-9 * random.random()))


@breaks(CONTROLLER, "an empty path", "accepts a path without points")
class AcceptsEmptyPath(Wrapper):
    def set_path(self, path):
        if len(path.points):
            self.inner.set_path(path)


@breaks(CONTROLLER, "path and costmap", "changes the path")
class ChangesPath(Wrapper):
    def set_path(self, path):
        self.inner.set_path(path)
        path.points[:, 1] += 0.01


@breaks(CONTROLLER, "path and costmap", "an old costmap affects a new command")
class KeepsFirstCostmap(Wrapper):
    first_costmap = None

    def command(self, pose, twist, costmap, goal):
        self.first_costmap = self.first_costmap or costmap
        speed_factor = 0.5 if (self.first_costmap.costs == 254).all() else 1.0
        command = self.inner.command(pose, twist, costmap, goal)
        return command._replace(vx=speed_factor * command.vx, wz=speed_factor * command.wz)


@breaks(CONTROLLER, "its local plan", "not a path of finite poses")
class ReturnsLocalPlanAsTuples(Wrapper):
    local_plan = ((0.0, 0.0), (1.0, 0.0))
