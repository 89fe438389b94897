"""Turning in place where the hull has corners: only where all of the turn has room, else back out first."""

import math

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.stack.arcs import poses_along
from simscen.stack.footprint import distance_at
from simscen.stack.lookahead import time_free
from simscen.stack.protocols import CostmapView
from simscen.stack.setting import Setting
from simscen.stack.way_back import WayBack

ROOM = 1.01
"""Cells between the hull and the nearest lethal cell's centre that a turn must keep: cells stand for obstacles that
may reach half a cell nearer, and behind the robot no scan corrects them."""
BACK_OUT, AS_FAR = 0.15, 3.0
"""m/s of backing out, Nav2's backup_speed, and metres at most."""
AHEAD, BENDS = 1.0, (0.3, -0.3, 0.6, -0.6)
"""Seconds of free way that a bend needs, and the turn rates in rad/s that are tried in this order."""
ELSEWHERE = 0.1
"""Metres from where it last backed out at which a robot begins anew."""


class TurningRoom:
    """Finds out whether a robot can turn where it is.

    A turn that is begun without room for all of it wedges the robot: its corners come nearer to obstacles with every
    step, until it can neither turn nor leave. So is one that backs out straight where it came in round a bend.
    """

    def __init__(self, setting: Setting) -> None:
        self._footprint = setting.footprint
        self._back, self._last = WayBack(setting, BACK_OUT), Pose2(math.inf, math.inf)

    def has_room(self, angle: float, pose: Pose2, costmap: CostmapView) -> bool:
        """Whether the hull keeps its room, or all that it has now, throughout a turn by `angle` rad."""
        reach = self._footprint.reach
        if reach == 0.0 or distance_at(costmap, pose.x, pose.y) > reach + 2.0 * costmap.resolution:
            return True
        steps = max(2, math.ceil(abs(angle) * reach / costmap.resolution) + 1)
        poses = poses_along(pose, Twist(0.0, 0.0, angle), np.linspace(0.0, 1.0, steps))
        room = self._footprint.clearance(costmap, poses)
        return bool((room >= min(ROOM * costmap.resolution, float(room[0]))).all())

    def back_out(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """Back the way it came, or where that is blocked on any bend; None when they are, too, or it cannot reverse."""
        if self._back.speed <= 0.0:
            return None
        if not self._last.distance(pose) <= ELSEWHERE:
            self._back.start(pose, AS_FAR)
        self._last = pose
        self._back.locate(pose)
        if (back := self._back.command(pose, costmap)) is not None:
            return back
        bends = (Twist(-self._back.speed, 0.0, rate) for rate in BENDS)
        return next((one for one in bends if time_free(self._footprint, costmap, pose, one, AHEAD) >= AHEAD), None)
