"""Planner of the advanced stack: BIT* on samples of the medial axis, followed by an optimization of the path."""

import numpy as np

from simscen.advanced.planners.path_refinement import refined
from simscen.advanced.planners.pose_planner import ConfinedPosePlanner
from simscen.advanced.planners.search_regions import Leg, searches
from simscen.advanced.planners.spec import MedialAxisPlanner as PlannerSpec
from simscen.advanced.planners.straight_line import straight_on
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.stack.planners.build import state_space_for
from simscen.stack.planners.endpoints import Endpoints, find_endpoints
from simscen.stack.planners.ompl_planner import FINE_CELLS
from simscen.stack.planners.ompl_search import Point
from simscen.stack.planners.path_postprocessing import SPACING_M, avoid_cell_corners, spaced, with_headings
from simscen.stack.planners.planning_window import plan_in_windows
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner, RobotModel
from simscen.stack.setting import Setting

MAX_CACHED_CELLS = 500_000
"""Largest costmap for which intermediate results are kept for the next plan, which takes up to 10 MB."""


def medial_axis_planner(spec: PlannerSpec, setting: Setting) -> Planner:
    """Build the planner in the plane, or over poses for cars and long hulls."""
    space = state_space_for(spec.state_space, setting.robot)
    if space == "holonomic":
        return MedialAxisPlanner(spec, setting.robot)
    return ConfinedPosePlanner(spec, setting.robot, setting.footprint, space)


class MedialAxisPlanner:
    """Plans in the plane for a disc of the robot's inscribed radius."""

    def __init__(self, spec: PlannerSpec, robot: RobotModel) -> None:
        self._spec, self._robot = spec, robot
        self._costs: TraversalCosts | None = None

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return a path of poses in the map frame, 5 cm apart. Raises NavigationFailure if there is none."""
        radius = self._robot.circumscribed_radius
        points = straight_on(costmap, start, goal, radius, lambda part, there: self._past(part, start, there, seed))
        if points is not None:
            return Path(with_headings(spaced(points, SPACING_M), goal))
        return plan_in_windows(self._plan, costmap, start, goal, seed)

    def _plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        costs = self._make_costs(costmap)
        self._costs = costs.after(self._costs) if costmap.costs.size <= MAX_CACHED_CELLS else None
        return Path(with_headings(self._points(costs, start, goal, seed), goal))

    def _past(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> tuple[Array, float]:
        """Return a path (n, 2) on a part of the costmap, and its cost."""
        costs = self._make_costs(costmap)
        points = self._points(costs, start, goal, seed)
        return points, costs.along(points)

    def _make_costs(self, costmap: CostmapView) -> TraversalCosts:
        return TraversalCosts(costmap, self._robot, self._spec.cost_travel_multiplier, self._spec.allow_unknown)

    def _points(self, costs: TraversalCosts, start: Pose2, goal: Pose2, seed: int) -> Array:
        ends = find_endpoints(costs, start, goal, self._spec.tolerance)
        path = np.array([ends.start]) if ends.start == ends.goal else self._search(costs, ends, seed)
        return spaced(np.vstack(((start.x, start.y), path)), SPACING_M)

    def _search(self, costs: TraversalCosts, ends: Endpoints, seed: int) -> Array:
        """Return the path (n, 2) of the first search that finds one."""
        for spacing in (costs.stride, FINE_CELLS * costs.resolution):
            costs.stride, was_rejected = spacing, False
            for number, legs in enumerate(searches(costs, ends, seed)):
                points = [ends.start]
                for leg in legs:
                    found = self._solve(leg, seed + number)
                    if found is None:
                        break
                    points += found[1:]
                else:
                    path = _finished(costs, np.array(points))
                    if path is not None:
                        return path
                    was_rejected = True
            if not was_rejected:
                break
        message = f"medial_axis: no path in {self._spec.max_iterations} iterations"
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)

    def _solve(self, leg: Leg, seed: int) -> list[Point] | None:
        return leg.search(seed, self._spec.max_iterations).solve(simplify=False)


def _finished(costs: TraversalCosts, points: Array) -> Array | None:
    """Return the path refined and led around corners; None if it passes a blocked cell between two checks."""
    path = avoid_cell_corners(costs, spaced(refined(costs, points), SPACING_M))
    return path if path is not None else avoid_cell_corners(costs, spaced(points, SPACING_M))
