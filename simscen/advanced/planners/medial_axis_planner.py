"""Planner of the advanced stack: BIT* on samples of the medial axis, and RRT-Connect for cars."""

from collections.abc import Iterator

import numpy as np

from simscen.advanced.planners.bit_star_searches import searches
from simscen.advanced.planners.informed_set import InformedSet
from simscen.advanced.planners.path_refinement import refine
from simscen.advanced.planners.straight_path import straight_path
from simscen.advanced.spec import MedialAxisPlanner as PlannerSpec
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.stack.planners.endpoints import Endpoints, find_endpoints
from simscen.stack.planners.ompl_planner import (
    FINE_SPACING_CELLS,
    Attempt,
    PosePlanner,
    state_space_for,
)
from simscen.stack.planners.path_postprocessing import SPACING_M, avoid_cell_corners, densify, with_headings
from simscen.stack.planners.planning_window import plan_in_windows
from simscen.stack.planners.pose_search import POSE_SPACING_M
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner, RobotModel
from simscen.stack.setting import Setting

MAX_CACHED_CELLS = 500_000
"""Number of cells up to which intermediate results of a costmap are kept for the next plan (10 MB)."""


def medial_axis_planner(spec: PlannerSpec, setting: Setting) -> Planner:
    """Return a MedialAxisPlanner or, for cars and long robots, a ConfinedPosePlanner."""
    space = state_space_for(spec.state_space, setting.robot)
    if space == "holonomic":
        return MedialAxisPlanner(spec, setting.robot)
    return ConfinedPosePlanner(spec, setting.robot, setting.footprint, space)


class MedialAxisPlanner:
    """Plans positions without headings, for a disc with the robot's inscribed radius."""

    def __init__(self, spec: PlannerSpec, robot: RobotModel) -> None:
        self._spec, self._robot = spec, robot
        self._costs: TraversalCosts | None = None

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return poses in the map frame, at most SPACING_M apart. A straight path is tried first.

        Raises NavigationFailure if there is no path.
        """
        radius = self._robot.circumscribed_radius
        points = straight_path(
            costmap, start, goal, radius, lambda part, part_goal: self._path_on_part(part, start, part_goal, seed)
        )
        if points is not None:
            return Path(with_headings(densify(points, SPACING_M), goal))
        return plan_in_windows(self._plan, costmap, start, goal, seed)

    def _plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return a path in a costmap, which can be a window of the entire costmap."""
        costs = self._make_costs(costmap)
        self._costs = costs.share_cache(self._costs) if costmap.costs.size <= MAX_CACHED_CELLS else None
        return Path(with_headings(self._points(costs, start, goal, seed), goal))

    def _path_on_part(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> tuple[Array, float]:
        """Return a path (n, 2) on the part of the costmap in which a straight path needs a detour, and its cost."""
        costs = self._make_costs(costmap)
        points = self._points(costs, start, goal, seed)
        return points, costs.along(points)

    def _make_costs(self, costmap: CostmapView) -> TraversalCosts:
        return TraversalCosts(costmap, self._robot, self._spec.cost_travel_multiplier, self._spec.allow_unknown)

    def _points(self, costs: TraversalCosts, start: Pose2, goal: Pose2, seed: int) -> Array:
        """Return the points (n, 2) of a path, at most SPACING_M apart. Raises NavigationFailure."""
        ends = find_endpoints(costs, start, goal, self._spec.tolerance)
        path = np.array([ends.start]) if ends.start == ends.goal else self._search(costs, ends, seed)
        return densify(np.vstack(((start.x, start.y), path)), SPACING_M)

    def _search(self, costs: TraversalCosts, ends: Endpoints, seed: int) -> Array:
        """Return the path (n, 2) of the first search that finds one. Raises NavigationFailure if none does."""
        for spacing in (costs.stride, FINE_SPACING_CELLS * costs.resolution):
            costs.stride, was_rejected = spacing, False
            for number, legs in enumerate(searches(costs, ends, seed)):
                points = [ends.start]
                for leg in legs:
                    found = leg.solve(seed + number, self._spec.max_iterations)
                    if found is None:
                        break
                    points += found[1:]
                else:
                    path = _postprocessed(costs, np.array(points))
                    if path is not None:
                        return path
                    was_rejected = True
            if not was_rejected:
                break
        message = f"medial_axis: no path in {self._spec.max_iterations} iterations"
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)


def _postprocessed(costs: TraversalCosts, points: Array) -> Array | None:
    """Return the path, refined and led around corners of blocked cells; None if the path crosses a blocked cell."""
    path = avoid_cell_corners(costs, densify(refine(costs, points), SPACING_M))
    return path if path is not None else avoid_cell_corners(costs, densify(points, SPACING_M))


ATTEMPTS = (
    (0.15, 1.0, 0.1, POSE_SPACING_M),
    (0.3, 1.0, 0.1, POSE_SPACING_M),
    (0.15, 0.5, 0.1, POSE_SPACING_M),
    (0.3, 0.5, 0.1, POSE_SPACING_M),
    (0.3, 0.0, 0.2, POSE_SPACING_M),
    (2.0, 0.0, 0.4, POSE_SPACING_M),
    (2.0, 0.0, 0.4, POSE_SPACING_M / 10),
)
"""Successive attempts, each with the slack of the informed set (see `InformedSet.restrict`), the ratio of the clearance
to `hull_clearance`, the share of the iterations, and the spacing of collision checks in m."""


class ConfinedPosePlanner(PosePlanner):
    """Plans poses with RRT-Connect, only within the informed set."""

    def _attempts(self, costs: TraversalCosts, ends: Endpoints, free_start: Pose2, goal: Pose2) -> Iterator[Attempt]:
        informed = InformedSet(costs, (free_start.x, free_start.y), (goal.x, goal.y))
        for slack, clearance_ratio, iteration_share, spacing in ATTEMPTS:
            informed.restrict(slack)
            clearance = clearance_ratio * self._spec.hull_clearance
            yield Attempt(informed.bounds(), informed.contains, clearance, iteration_share, spacing)
