"""The planner of the reference stack: a search by OMPL over the costs of the costmap."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.planners.endpoints import Endpoints, find_endpoints
from simscen.stack.planners.ompl_search import OmplSearch, Problem
from simscen.stack.planners.path_postprocessing import SPACING_M, avoid_cell_corners, spaced, with_headings
from simscen.stack.planners.planning_window import plan_in_windows
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel

FINE_CELLS = 0.125
"""Spacing of the checks of another search, if the path of the first one leads through something between its checks."""
SEARCHES = 4
"""Searches with other random numbers before planning fails: a search may miss a narrow gap."""


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
        points = np.array([ends.start]) if ends.start == ends.goal else self._search(costs, ends, seed)
        points = spaced(np.vstack(((start.x, start.y), points)), SPACING_M)
        return Path(with_headings(points, goal))

    def _search(self, costs: TraversalCosts, ends: Endpoints, seed: int) -> Array:
        """Return the points (n, 2) of a path that leads through no blocked cell."""
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
    """Return the search in the bounding box of everything that can be reached from the start."""
    return Problem(ends.start, ends.goal, reachable_bounds(costs, ends), costs.between)


def reachable_bounds(costs: TraversalCosts, ends: Endpoints) -> tuple[float, float, float, float]:
    """Return the bounding box (min x, min y, max x, max y) of everything that can be reached, in m."""
    rows, columns = np.flatnonzero(ends.reachable.any(axis=1)), np.flatnonzero(ends.reachable.any(axis=0))
    (x, y), size = costs.origin, costs.resolution
    return (
        float(x + columns[0] * size),
        float(y + rows[0] * size),
        float(x + (columns[-1] + 1) * size),
        float(y + (rows[-1] + 1) * size),
    )
