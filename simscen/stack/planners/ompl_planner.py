"""The planner of the reference stack: OMPL over the costmap's costs, between ends that were checked, then eased."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.planners.corners import around_corners
from simscen.stack.planners.ends import Ends, find_ends
from simscen.stack.planners.finish import SPACING, spaced, with_headings
from simscen.stack.planners.nearby import nearby
from simscen.stack.planners.rates import Rates
from simscen.stack.planners.samplers import SAMPLERS, Legs
from simscen.stack.planners.search import Point, search
from simscen.stack.planners.straight import straight_on
from simscen.stack.planners.tube import eased
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel

FINE = 0.125
"""Cells between two looks of a second search, where the first one's way led over what lay between its looks."""
MOST_KEPT = 500_000
"""Cells of a costmap of which what was worked out for one plan is kept for the next: up to 10 MB."""


class OmplPlanner:
    """Plans for a disc of the robot's inscribed radius, by what each place costs."""

    def __init__(self, spec: PlannerSpec, robot: RobotModel) -> None:
        self._spec, self._robot = spec, robot
        self._rates: Rates | None = None
        self._cheapest = spec.type == "bit_star" and spec.simplify  # the others go about it in their own way
        by_type = "medial_axis" if spec.type == "bit_star" else "uniform"
        self._sampler = SAMPLERS[by_type if spec.sampler == "auto" else spec.sampler]

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """A path of poses in the map frame, 5 cm apart."""
        if self._cheapest:
            radius = self._robot.circumscribed_radius
            points = straight_on(costmap, start, goal, radius, lambda part, there: self._past(part, start, there, seed))
            if points is not None:
                return Path(with_headings(spaced(points, SPACING), goal))
        return nearby(self._plan, costmap, start, goal, seed)

    def _plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        rates = self._counted(costmap)
        self._rates = rates.after(self._rates) if costmap.costs.size <= MOST_KEPT else None
        return Path(with_headings(self._points(rates, start, goal, seed), goal))

    def _past(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> tuple[Array, float]:
        """A way (n, 2) on a part of the costmap, and what it costs."""
        rates = self._counted(costmap)
        points = self._points(rates, start, goal, seed)
        return points, rates.along(points)

    def _counted(self, costmap: CostmapView) -> Rates:
        return Rates(costmap, self._robot, self._spec.cost_travel_multiplier, self._spec.allow_unknown)

    def _points(self, rates: Rates, start: Pose2, goal: Pose2, seed: int) -> Array:
        ends = find_ends(rates, start, goal, self._spec.tolerance)
        way = np.array([ends.start]) if ends.start == ends.goal else self._way(rates, ends, seed)
        return spaced(np.vstack(((start.x, start.y), way)), SPACING)

    def _way(self, rates: Rates, ends: Ends, seed: int) -> Array:
        """What the first search finds that finds a way."""
        for stride in (rates.stride, FINE * rates.resolution):
            rates.stride, rejected = stride, False
            for number, legs in enumerate(self._sampler(rates, ends, seed)):
                points = self._whole_way(ends, legs, seed + number)
                if points is None:
                    continue
                way = self._finished(rates, np.array(points))
                if way is not None:
                    return way
                rejected = True
            if not rejected:
                break
        message = f"{self._spec.type}: no path in {self._spec.max_iterations} iterations"
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)

    def _finished(self, rates: Rates, points: Array) -> Array | None:
        """The way eased and led around corners; None where it passes something between two looks of the search."""
        if self._spec.simplify:
            way = around_corners(rates, spaced(eased(rates, points), SPACING))
            if way is not None:
                return way
        return around_corners(rates, spaced(points, SPACING))

    def _whole_way(self, ends: Ends, legs: Legs, seed: int) -> list[Point] | None:
        points = [ends.start]
        for problem in legs:
            leg = search(self._spec.type, problem, seed, self._spec.max_iterations, self._spec.improving_iterations)
            if leg is None:
                return None
            points += leg[1:]
        return points
