"""The planner of the reference stack: a search by OMPL over the costs of the costmap."""

from dataclasses import replace
from typing import Literal

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.model.planners import StateSpace
from simscen.stack.planners.endpoints import Endpoints, find_endpoints, reachable_bounds, reachable_cells
from simscen.stack.planners.ompl_search import OmplSearch, Problem
from simscen.stack.planners.path_postprocessing import SPACING_M, avoid_cell_corners, spaced, with_headings
from simscen.stack.planners.planning_window import plan_in_windows
from simscen.stack.planners.pose_planner import PosePlanner
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner, RobotModel
from simscen.stack.setting import Setting

FINE_CELLS = 0.125
"""Spacing of the collision checks of the next search, if the path of the first one is blocked between its checks."""
SEARCHES = 4
"""Number of searches with different seeds before planning fails, because a search may miss a narrow gap."""


class OmplPlanner:
    """Plans in the plane for a disc of the robot's inscribed radius."""

    def __init__(self, spec: PlannerSpec, robot: RobotModel) -> None:
        self._spec, self._robot = spec, robot

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return a path of poses in the map frame, 5 cm apart. Raises NavigationFailure if there is none."""
        return plan_in_windows(self._plan, costmap, start, goal, seed)

    def _plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        costs = TraversalCosts(costmap, self._robot, self._spec.cost_travel_multiplier, self._spec.allow_unknown)
        ends = find_endpoints(costs, start, goal, self._spec.tolerance)
        costs, ends = self._avoid_narrow_gaps(costs, ends)
        points = np.array([ends.start]) if ends.start == ends.goal else self._search(costs, ends, seed)
        points = spaced(np.vstack(((start.x, start.y), points)), SPACING_M)
        return Path(with_headings(points, goal))

    def _avoid_narrow_gaps(self, costs: TraversalCosts, ends: Endpoints) -> tuple[TraversalCosts, Endpoints]:
        """Return costs with narrow gaps blocked, if start and goal are connected without them."""
        if self._spec.gap_clearance == 0.0:
            return costs, ends
        wide = costs.without_narrow_gaps(self._spec.gap_clearance, (ends.start, ends.goal))
        reachable = reachable_cells(wide, ends.start)
        return (wide, replace(ends, reachable=reachable)) if reachable[wide.cell(ends.goal)] else (costs, ends)

    def _search(self, costs: TraversalCosts, ends: Endpoints, seed: int) -> Array:
        """Return the points (n, 2) of a path without blocked cells."""
        spec, problem = self._spec, whole_problem(costs, ends)
        for number in range(SEARCHES):
            search = OmplSearch(spec.type, problem, seed + number, spec.max_iterations, spec.improving_iterations)
            points = search.solve(simplify=spec.simplify)
            if points is None:
                continue
            path = avoid_cell_corners(costs, spaced(np.array(points), SPACING_M))
            if path is not None:
                return path
            costs.stride = FINE_CELLS * costs.resolution
        message = f"{spec.type}: no path in {SEARCHES} searches of {spec.max_iterations} iterations"
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)


def whole_problem(costs: TraversalCosts, ends: Endpoints) -> Problem:
    """Return the problem in the bounding box of the cells that are reachable from the start."""
    return Problem(ends.start, ends.goal, reachable_bounds(costs, ends), costs.between)


LONG_HULL_RATIO = 2.0
"""Ratio of circumscribed to inscribed radius above which the planner considers the heading of the robot."""


def ompl_planner(spec: PlannerSpec, setting: Setting) -> Planner:
    """Build a planner in the requested state space, or in the one that fits the robot."""
    space = state_space_for(spec.state_space, setting.robot)
    if space == "holonomic":
        return OmplPlanner(spec, setting.robot)
    return PosePlanner(spec, setting.robot, setting.footprint, space)


def state_space_for(requested: StateSpace, robot: RobotModel) -> Literal["holonomic", "se2", "dubins", "reeds_shepp"]:
    """Return the state space to plan in.

    auto: Reeds-Shepp for a base with a turning radius, otherwise "se2" for a long hull, otherwise the plane. For a base
    that cannot move sideways, "se2" becomes Dubins paths with tight arcs: its heading is that of its path.
    """
    space = requested
    if space == "auto":
        if robot.turning_radius > 0.0:
            space = "reeds_shepp"
        else:
            space = "se2" if robot.circumscribed_radius > LONG_HULL_RATIO * robot.inscribed_radius else "holonomic"
    return "dubins" if space == "se2" and not robot.holonomic else space
