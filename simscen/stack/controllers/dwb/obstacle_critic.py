"""Collision check of trajectories: DWB's BaseObstacle and ObstacleFootprint critics, including moving obstacles."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.controllers.collision_checker import APPROACH_TOLERANCE_M, UNCERTAINTY_SIGMAS
from simscen.stack.controllers.dwb.trajectory_generator import Trajectories
from simscen.stack.footprint import Footprint
from simscen.stack.moving_obstacles import MovingObstacles
from simscen.stack.protocols import CostmapView

PREFERRED_CLEARANCE_M = 0.05
"""Clearance that trajectories keep wherever one of them can."""
BATCH_TRAJECTORIES = 50
"""Trajectories that are looked at together: mostly one of the best is free, and the others need no look."""


class ObstacleCritic:
    """Finds the first of trajectories that hits nothing."""

    def __init__(self, footprint: Footprint) -> None:
        self._footprint = footprint

    def first_free(
        self, costmap: CostmapView, pose: Pose2, tried: Trajectories, order: npt.NDArray[np.intp]
    ) -> int | None:
        """Return the first trajectory in this order (best first) that keeps the preferred clearance, or that is free.

        From a collision, the first that leads out of it. Among things that move, first come those that meet none of
        them, and then those that meet them last.
        """
        if len(costmap.moving):
            order = order[np.argsort(-self._unmet(costmap.moving, tried, order), kind="stable")]
        gaps = np.empty((len(tried.x), len(order)), np.float32)
        for start in range(0, len(order), BATCH_TRAJECTORIES):
            part = slice(start, start + BATCH_TRAJECTORIES)
            gaps[:, part] = self._footprint.discs.clearance(costmap, *np.moveaxis(tried.poses(order[part]), -1, 0))
            roomy = (gaps[:, part] > PREFERRED_CLEARANCE_M).all(axis=0)
            if roomy.any():
                return int(order[start + int(roomy.argmax())])
        free = (gaps > 0.0).all(axis=0)
        if not free.any():
            poses = tried.poses(order).reshape(-1, 3)
            free = self._footprint.free(costmap, poses).reshape(gaps.shape).all(axis=0)
        if not free.any() and self._footprint.clearance(costmap, np.array([pose]))[0] <= 0.0:
            no_nearer = (gaps >= gaps[0]).all(axis=0)
            free = no_nearer & (gaps[-1] > gaps[0] + 0.5 * costmap.resolution)
        return int(order[int(free.argmax())]) if free.any() else None

    def _unmet(self, moving: MovingObstacles, tried: Trajectories, order: npt.NDArray[np.intp]) -> Array:
        """Seconds (k,) for which these trajectories meet nothing that moves, where both will be; inf for all of it."""
        times = tried.passed[:, tried.turn[order]]
        gaps = self._footprint.gap(moving, tried.poses(order), times, UNCERTAINTY_SIGMAS)
        met = (gaps < PREFERRED_CLEARANCE_M) & (gaps < gaps[0] - APPROACH_TOLERANCE_M)
        return np.where(met.any(axis=0), times[met.argmax(axis=0), np.arange(len(order))], np.inf)
