"""The plan ahead as controllers that score trajectories see it: nav2_controller's path handler."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.controllers.tracking import PathTracker

Floats = npt.NDArray[np.float32]
SPACING = 0.05
"""Meters between points: Nav2's planners put one into each cell of a costmap, and its critics count points."""


@dataclass(frozen=True, eq=False)
class LocalPlan:
    """Poses (n, 3) from where the robot is on its path, `spacing` meters apart, and its `length`.

    It ends where the robot must next turn round, at the path's end, or after as many meters as were asked for.
    """

    points: Array
    spacing: float
    length: float

    def about(self, pose: Pose2) -> tuple[Floats, Floats, Floats]:
        """x, y (n,) with the robot at the origin of the unrotated frame, and yaw: short numbers for float32."""
        x, y, yaw = self.points.T
        return (x - pose.x).astype(np.float32), (y - pose.y).astype(np.float32), yaw.astype(np.float32)


def local_plan(track: PathTracker, meters: float, spacing: float = SPACING) -> LocalPlan:
    """The next `meters` of the path, its points at most `spacing` meters apart."""
    points, along = track.ahead(meters)
    length = float(min(meters, along[-1]))
    steps = max(1, math.ceil(length / spacing - 1e-9))
    at = np.arange(steps + 1) * (length / steps)
    at[-1] = length
    x, y = np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1])
    yaw = points[np.minimum(np.searchsorted(along, at + 1e-9, side="right"), len(points)) - 1, 2]
    return LocalPlan(np.stack((x, y, yaw), axis=-1), length / steps, length)
