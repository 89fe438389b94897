"""Planners, each of which breaks a promise."""

import math
import random
import time

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Path
from simscen.model.planners import OmplPlanner
from simscen.stack.protocols import NavigationFailure
from tests.contracts.broken.cases import Wrapper, breaks

PLANNER = OmplPlanner()


def _with_offset(path, share):
    """Move one pose of a path by up to 1 mm, because two seeds sometimes give the same plan."""
    points = path.points.copy()
    points[len(points) // 2, 0] += 1e-3 * share
    return Path(points)


@breaks(PLANNER, "success begins at the start", "begins 0.5")
class StartsElsewhere(Wrapper):
    def plan(self, costmap, start, goal, seed):
        return self.inner.plan(costmap, Pose2(start.x + 0.5, start.y, 0), goal, seed)


@breaks(PLANNER, "success begins at the start", "from the goal, tolerance")
class EndsBeforeGoal(Wrapper):
    def plan(self, *arguments):
        return Path(self.inner.plan(*arguments).points[:-30])


@breaks(PLANNER, "points are at most", "m apart")
class OmitsPoints(Wrapper):
    def plan(self, *arguments):
        return Path(self.inner.plan(*arguments).points[::4])


@breaks(PLANNER, "the footprint is never", "is in collision at")
class IgnoresObstacles(Wrapper):
    def plan(self, costmap, start, goal, seed):
        self.inner.plan(costmap, start, goal, seed)
        share = np.linspace(0, 1, 200)[:, None]
        return Path(np.array(start) * (1 - share) + np.array(goal) * share)


@breaks(
    PLANNER,
    "an impossible request fails with its error code",
    "raises ValueError when it plans",
)
class RaisesValueError(Wrapper):
    def plan(self, *arguments):
        try:
            return self.inner.plan(*arguments)
        except NavigationFailure as failure:
            raise ValueError("no path") from failure


@breaks(PLANNER, "an impossible request fails with its error code", "which is not an ErrorCode")
class RaisesUnknownCode(Wrapper):
    def plan(self, *arguments):
        try:
            return self.inner.plan(*arguments)
        except NavigationFailure as failure:
            raise NavigationFailure(4711, "no path") from failure  # type: ignore[arg-type]


@breaks(PLANNER, "an impossible request fails with its error code", "without points")
class ReturnsEmptyPath(Wrapper):
    def plan(self, *arguments):
        try:
            return self.inner.plan(*arguments)
        except NavigationFailure:
            return Path()


@breaks(PLANNER, "an impossible request fails with its error code", "does not return")
class NeverReturns(Wrapper):
    def plan(self, *arguments):
        while True:
            try:
                return self.inner.plan(*arguments)
            except NavigationFailure:
                continue


@breaks(PLANNER, "the same seed", "two paths from the same seed differ")
class UsesGlobalRandom(Wrapper):
    def plan(self, *arguments):
        return _with_offset(self.inner.plan(*arguments), random.random())


@breaks(PLANNER, "the same seed", "two paths from the same seed differ")
class UsesWallClock(Wrapper):
    def plan(self, *arguments):
        return _with_offset(self.inner.plan(*arguments), time.perf_counter_ns() % 10**9 / 10**9)


@breaks(PLANNER, "the same seed", "two paths from the same seed differ")
class CountsPlans(Wrapper):
    plans = 0

    def plan(self, costmap, start, goal, seed):
        self.plans += 1
        return self.inner.plan(costmap, start, goal, seed + 101 * self.plans)


@breaks(PLANNER, "a costmap is neither", "changes the costmap")
class ChangesCostmap(Wrapper):
    def plan(self, costmap, *arguments):
        costmap.costs[0, 0] = 7
        return self.inner.plan(costmap, *arguments)


@breaks(PLANNER, "a costmap is neither", "an old costmap affects a new plan")
class KeepsFirstCostmap(Wrapper):
    first_costmap = None

    def plan(self, costmap, start, goal, seed):
        self.first_costmap = self.first_costmap or costmap
        is_lethal = (self.first_costmap.costs == 254).all()
        return self.inner.plan(costmap, start, goal, seed + int(is_lethal))


@breaks(PLANNER, "success begins", "not finite float64")
class ReturnsNan(Wrapper):
    def plan(self, *arguments):
        points = self.inner.plan(*arguments).points.copy()
        points[3, 0] = math.nan
        return Path(points)


@breaks(PLANNER, "success begins", "points are not (n, 3)")
class OmitsHeadings(Wrapper):
    def plan(self, *arguments):
        return Path(self.inner.plan(*arguments).points[:, :2])
