"""Driving back the way the robot came. Nav2 has nothing like it."""

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.model import recovery as model
from simscen.stack.behaviors.motions import TIME_ALLOWANCE
from simscen.stack.footprint import distance_at
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting
from simscen.stack.way_back import WayBack

SLOWLY = 1.5
"""Times as long as the way takes at full speed it may take, for it is driven in part at half of it."""


class Retrace:
    """Drive back the way it came, turns included, until there is room to turn."""

    name = "retrace"

    def __init__(self, spec: model.Retrace, setting: Setting) -> None:
        self._spec, self._footprint = spec, setting.footprint
        self._back = WayBack(setting, spec.backup_speed)

    def start(self, pose: Pose2) -> None:
        """Begin from this pose."""
        self._back.start(pose, max(self._spec.backup_dist, self._spec.retrace_dist))

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Back on; None when far enough, or when it has come some way and there is none that is free.

        Raises BACKUP_COLLISION_AHEAD when there is not even a cell of room, BACKUP_TIMEOUT, BACKUP_INVALID_INPUT.
        """
        back = self._back
        if back.speed <= 0.0:
            raise NavigationFailure(ErrorCode.BACKUP_INVALID_INPUT, "the robot cannot drive backward")
        back.locate(pose)
        if back.driven >= self._spec.retrace_dist:
            return None
        if back.driven >= self._spec.backup_dist and self._may_turn(pose, costmap):
            return None
        if seconds > max(TIME_ALLOWANCE, SLOWLY * self._spec.retrace_dist / back.speed):
            raise NavigationFailure(ErrorCode.BACKUP_TIMEOUT, "driving back the way it came took too long")
        command = back.command(pose, costmap)
        if command is None and back.moved < costmap.resolution:
            raise NavigationFailure(ErrorCode.BACKUP_COLLISION_AHEAD, "no room on the way it came")
        return command

    def _may_turn(self, pose: Pose2, costmap: CostmapView) -> bool:
        return distance_at(costmap, pose.x, pose.y) > self._footprint.circumscribed + costmap.resolution
