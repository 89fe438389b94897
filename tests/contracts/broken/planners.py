"""Planners that break a promise each."""

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


def _nudged(path, share):
    """A path of which one pose is up to a millimeter off: plans from two seeds are now and then the same."""
    points = path.points.copy()
    points[len(points) // 2, 0] += 1e-3 * share
    return Path(points)


@breaks(PLANNER, "success begins at the start", "begins 0.5")
class BeginsElsewhere(Wrapper):
    def plan(self, costmap, start, goal, seed):
        return self.inner.plan(costmap, Pose2(start.x + 0.5, start.y, 0), goal, seed)


@breaks(PLANNER, "success begins at the start", "from the goal, tolerance")
class StopsShort(Wrapper):
    def plan(self, *asked):
        return Path(self.inner.plan(*asked).points[:-30])


@breaks(PLANNER, "points are at most", "m apart")
class LeavesOutPoints(Wrapper):
    def plan(self, *asked):
        return Path(self.inner.plan(*asked).points[::4])


@breaks(PLANNER, "the footprint is never", "is in collision at")
class GoesThroughWalls(Wrapper):
    def plan(self, costmap, start, goal, seed):
        self.inner.plan(costmap, start, goal, seed)
        share = np.linspace(0, 1, 200)[:, None]
        return Path(np.array(start) * (1 - share) + np.array(goal) * share)


@breaks(
    PLANNER,
    "an impossible request fails with its error code",
    "raises ValueError when it plans, not a NavigationFailure",
)
class RaisesWhatItLikes(Wrapper):
    def plan(self, *asked):
        try:
            return self.inner.plan(*asked)
        except NavigationFailure as failure:
            raise ValueError("no way") from failure


@breaks(PLANNER, "an impossible request fails with its error code", "which is not an ErrorCode")
class HasItsOwnCodes(Wrapper):
    def plan(self, *asked):
        try:
            return self.inner.plan(*asked)
        except NavigationFailure as failure:
            raise NavigationFailure(4711, "no way") from failure  # type: ignore[arg-type]


@breaks(PLANNER, "an impossible request fails with its error code", "without points")
class AnswersWithNothing(Wrapper):
    def plan(self, *asked):
        try:
            return self.inner.plan(*asked)
        except NavigationFailure:
            return Path()


@breaks(PLANNER, "an impossible request fails with its error code", "does not return")
class NeverGivesUp(Wrapper):
    def plan(self, *asked):
        while True:
            try:
                return self.inner.plan(*asked)
            except NavigationFailure:
                continue


@breaks(PLANNER, "the same seed", "two paths from the same seed differ")
class DrawsFromTheGlobalGenerator(Wrapper):
    def plan(self, *asked):
        return _nudged(self.inner.plan(*asked), random.random())


@breaks(PLANNER, "the same seed", "two paths from the same seed differ")
class AsksTheClock(Wrapper):
    def plan(self, *asked):
        return _nudged(self.inner.plan(*asked), time.perf_counter_ns() % 10**9 / 10**9)


@breaks(PLANNER, "the same seed", "two paths from the same seed differ")
class RemembersHowOften(Wrapper):
    plans = 0

    def plan(self, costmap, start, goal, seed):
        self.plans += 1
        return self.inner.plan(costmap, start, goal, seed + 101 * self.plans)


@breaks(PLANNER, "a costmap is neither", "changes the costmap")
class DrawsIntoTheCostmap(Wrapper):
    def plan(self, costmap, *asked):
        costmap.costs[0, 0] = 7
        return self.inner.plan(costmap, *asked)


@breaks(PLANNER, "a costmap is neither", "an old costmap affects a new plan")
class KeepsItsFirstCostmap(Wrapper):
    kept = None

    def plan(self, costmap, start, goal, seed):
        self.kept = self.kept or costmap
        lethal = (self.kept.costs == 254).all()
        return self.inner.plan(costmap, start, goal, seed + int(lethal))


@breaks(PLANNER, "success begins", "not finite float64")
class PlansNothings(Wrapper):
    def plan(self, *asked):
        points = self.inner.plan(*asked).points.copy()
        points[3, 0] = math.nan
        return Path(points)


@breaks(PLANNER, "success begins", "points are not (n, 3)")
class ForgetsHeadings(Wrapper):
    def plan(self, *asked):
        return Path(self.inner.plan(*asked).points[:, :2])
