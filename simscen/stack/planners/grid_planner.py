"""Grid planners for round robots, like NavFn and SmacPlanner2D of Nav2: find the cheapest path from cell to cell."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.grid_graph import EIGHT_NEIGHBORS, SIXTEEN_NEIGHBORS, GridGraph
from simscen.model.planners import Navfn, Smac2d
from simscen.stack.planners.endpoints import Endpoints, find_endpoints
from simscen.stack.planners.path_postprocessing import (
    SPACING_M,
    avoid_cell_corners,
    densify,
    smooth_path,
    with_headings,
)
from simscen.stack.planners.planning_window import plan_in_windows
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import MAX_NON_OBSTACLE, CostmapView, NavigationFailure, Planner, RobotModel
from simscen.stack.setting import Setting

COST_FACTOR, COST_NEUTRAL = 0.8, 50
"""Coefficients of NavFn: the traversal cost of a cell is 50 + 0.8 · cost (nav2_navfn_planner/navfn.hpp)."""
BORDER_CELLS = 2
"""Width of the border of blocked cells around the costmap, which GridGraph needs."""


def navfn(spec: Navfn, setting: Setting) -> Planner:
    """Build a planner like NavFn, but with moves in 16 directions instead of a gradient descent on the potential."""
    multiplier = COST_FACTOR * MAX_NON_OBSTACLE / COST_NEUTRAL
    return GridPlanner(spec.tolerance, multiplier, spec.allow_unknown, SIXTEEN_NEIGHBORS, True, setting.robot)


def smac_2d(spec: Smac2d, setting: Setting) -> Planner:
    """Build a planner like SmacPlanner2D, with moves to the eight neighbors (Moore neighborhood)."""
    return GridPlanner(
        spec.tolerance,
        spec.cost_travel_multiplier,
        spec.allow_unknown,
        EIGHT_NEIGHBORS,
        spec.smooth_path,
        setting.robot,
    )


class GridPlanner:
    """Plans with Dijkstra's algorithm on the costmap cells.

    `moves` are the allowed moves between cells, in (rows, columns). `multiplier` weights the costs of cells as in
    TraversalCosts. With `smooth`, the path is smoothed.
    """

    def __init__(
        self,
        tolerance: float,
        multiplier: float,
        allow_unknown: bool,
        moves: tuple[tuple[int, int], ...],
        smooth: bool,
        robot: RobotModel,
    ) -> None:
        self._tolerance, self._multiplier, self._allow_unknown = tolerance, multiplier, allow_unknown
        self._moves, self._smooth, self._robot = moves, smooth, robot

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return a path of poses in the map frame, at most 5 cm apart. Raises NavigationFailure if there is no path.

        The seed has no effect.
        """
        return plan_in_windows(self._plan, costmap, start, goal, seed)

    def _plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, _: int) -> Path:
        """Return the path on a costmap or on a window of it."""
        costs = TraversalCosts(costmap, self._robot, self._multiplier, self._allow_unknown)
        ends = find_endpoints(costs, start, goal, self._tolerance)
        path = self._postprocess(costs, ends, self._search(costs, ends))
        return Path(with_headings(densify(np.vstack(((start.x, start.y), path)), SPACING_M), goal))

    def _postprocess(self, costs: TraversalCosts, ends: Endpoints, cells: Array) -> Array:
        """Return a path (n, 2) from start to goal that cuts no corners of blocked cells, smoothed if requested.

        `cells` (n, 2) are the centers of the cells on the path.
        """
        raw = np.vstack((ends.start, cells[1:-1], ends.goal))
        for points in (smooth_path(costs, raw), raw) if self._smooth else (raw,):
            path = avoid_cell_corners(costs, densify(points, SPACING_M))
            if path is not None:
                return path
        return np.vstack((ends.start, cells, ends.goal))  # no move between cell centers cuts a corner

    def _search(self, costs: TraversalCosts, ends: Endpoints) -> Array:
        """Return the centers (n, 2) of the cells of the cheapest path."""
        graph = GridGraph(np.pad(ends.reachable, BORDER_CELLS), self._moves, np.pad(costs.rates, BORDER_CELLS))
        first, last = (
            tuple(int((point[axis] - costs.origin[axis]) / costs.resolution) + BORDER_CELLS for axis in (1, 0))
            for point in (ends.start, ends.goal)
        )
        cells = graph.shortest_path((first[0], first[1]), (last[0], last[1]))
        if cells is None:
            raise NavigationFailure(ErrorCode.NO_VALID_PATH, "start and goal are not connected on the costmap")
        centers: Array = (cells[:, ::-1] - BORDER_CELLS + 0.5) * costs.resolution + np.array(costs.origin)
        return centers
