"""Whether a trajectory hits anything: dwb_critics' BaseObstacle and ObstacleFootprint as a veto."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import CostmapView

ROOM = 0.05
"""Metres that trajectories keep off obstacles where any can."""
AT_ONCE = 50
"""Trajectories that are looked at together: mostly one of the best is free, and the others need no look."""


class Room:
    """Finds the first of trajectories that hits nothing."""

    def __init__(self, footprint: Footprint) -> None:
        self._footprint = footprint

    def first_free(self, costmap: CostmapView, pose: Pose2, poses: Array) -> int | None:
        """The first of the trajectories (n, steps, 3), the best coming first, that keeps ROOM; else that hits nothing.

        From a collision, the first that leads out of it.
        """
        gaps = np.empty(poses.shape[:2], np.float32)
        for start in range(0, len(poses), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            x, y, yaw = np.moveaxis(poses[part], -1, 0)
            gaps[part] = self._footprint.discs.clearance(costmap, x, y, yaw)
            roomy = (gaps[part] > ROOM).all(axis=1)
            if roomy.any():
                return start + int(roomy.argmax())
        free = (gaps > 0.0).all(axis=1)
        if not free.any():
            free = self._footprint.free(costmap, poses.reshape(-1, 3)).reshape(gaps.shape).all(axis=1)
        if not free.any() and self._footprint.clearance(costmap, np.array([pose]))[0] <= 0.0:
            no_nearer = (gaps >= gaps[:, :1]).all(axis=1)
            free = no_nearer & (gaps[:, -1] > gaps[:, 0] + 0.5 * costmap.resolution)
        return int(free.argmax()) if free.any() else None
