"""Whether what a controller is about to drive is free: the check that all of them share."""

from simscen.core.geometry import Pose2
from simscen.core.motion import STOP, Twist
from simscen.core.navigation import ErrorCode
from simscen.stack.footprint import Footprint
from simscen.stack.lookahead import time_free
from simscen.stack.protocols import CostmapView, NavigationFailure

CREEP = 0.1
"""m/s. When only slower than this would keep the time to collision, the way is blocked."""


class FreeWay:
    """Looks along the arc of a command, and slows the command down where the arc is not free for long enough."""

    def __init__(self, footprint: Footprint) -> None:
        self._footprint = footprint

    def seconds(self, costmap: CostmapView, pose: Pose2, command: Twist, horizon: float) -> float:
        """For how long the command can be driven; `horizon` if for all of it."""
        return horizon if command == STOP else time_free(self._footprint, costmap, pose, command, horizon)

    def within(self, command: Twist, free: float, horizon: float, demanded: float) -> Twist:
        """The command, so slow that what is free now lasts for the seconds demanded. Raises NO_VALID_CONTROL.

        Nav2 fails at once; slowing first lets the planner find a way round before the robot stands before a wall.
        """
        if free >= horizon:
            return command
        scale = free / demanded
        if max(abs(command.vx), abs(command.vy)) * scale < CREEP:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, f"collision ahead in {free:.2f} s")
        return Twist(command.vx * scale, command.vy * scale, command.wz * scale)
