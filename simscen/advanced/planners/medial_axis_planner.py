"""Planner of the advanced stack: BIT* on samples of the medial axis, followed by an optimization of the path."""

import math
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from simscen.advanced.planners.informed_set import InformedSet
from simscen.advanced.planners.path_refinement import refined
from simscen.advanced.planners.search_regions import Leg, searches
from simscen.advanced.planners.spec import MedialAxisPlanner as PlannerSpec
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.stack.planners.endpoints import Endpoints, find_endpoints
from simscen.stack.planners.ompl_planner import FINE_CELLS, state_space_for
from simscen.stack.planners.ompl_search import Point
from simscen.stack.planners.path_postprocessing import SPACING_M, avoid_cell_corners, spaced, with_headings
from simscen.stack.planners.planning_window import plan_in_windows, window
from simscen.stack.planners.pose_planner import CLEARANCE_M, LESS_CLEARANCE_M, Attempt, PosePlanner
from simscen.stack.planners.pose_search import POSE_SPACING_M
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


ATTEMPTS = (
    (0.15, CLEARANCE_M, 0.1, POSE_SPACING_M),
    (0.3, CLEARANCE_M, 0.1, POSE_SPACING_M),
    (0.15, LESS_CLEARANCE_M, 0.1, POSE_SPACING_M),
    (0.3, LESS_CLEARANCE_M, 0.1, POSE_SPACING_M),
    (0.3, 0.0, 0.2, POSE_SPACING_M),
    (2.0, 0.0, 0.4, POSE_SPACING_M),
    (2.0, 0.0, 0.4, POSE_SPACING_M / 10),
)
"""Slack of the informed set as a ratio, clearance in m, share of the iterations, and spacing of checks in m.

Cars need wider sets than discs because they swing out.
"""


class ConfinedPosePlanner(PosePlanner):
    """Plans over poses in the informed set: a tree cannot lose itself in a wrong room."""

    def _attempts(self, costs: TraversalCosts, ends: Endpoints, begin: Pose2, goal: Pose2) -> Iterator[Attempt]:
        """Yield the attempts in turn, in wider and wider informed sets."""
        informed = InformedSet(costs, (begin.x, begin.y), (goal.x, goal.y))
        for slack, clearance, share, spacing in ATTEMPTS:
            informed.narrow(slack)
            yield Attempt(informed.bounds(), informed.has, clearance, share, spacing)


MOST_DEAR = 0.5
"""Of the way, what may be searched for: of a longer part that is no less than of all."""
BEYOND, BESIDE = 2.0, 2.0
"""Meters behind what is dear of the straight way, and on all sides of both ends, in which the way past is sought."""
HARDLY_DEARER = 1.01
"""How much more than its length (ratio) the whole may cost then. Plans are promised within 5 % of the optimum."""
Past = Callable[[CostmapView, Pose2], tuple[Array, float]]
"""From a part of a costmap and a pose on it to a way there (n, 2), and its cost. Raises NavigationFailure."""


def straight_on(costmap: CostmapView, start: Pose2, goal: Pose2, radius: float, past: Past) -> Array | None:
    """Points (n, 2) from start to goal, straight on or `past` what is dear before; None where that may be too dear."""
    length = start.distance(goal)
    dear = dear_until(costmap, start, goal, radius)
    if dear == 0.0:
        return np.array((start[:2], goal[:2]))
    if dear + BEYOND > MOST_DEAR * length:
        return None
    share = (dear + BEYOND) / length
    there = Pose2(start.x + share * (goal.x - start.x), start.y + share * (goal.y - start.y))
    part = window(costmap, start, there, BESIDE)
    if part is None:
        return None
    try:
        points, cost = past(part, there)
    except NavigationFailure:
        return None
    hardly = cost + (1.0 - share) * length <= HARDLY_DEARER * length
    return np.vstack((points, goal[:2])) if hardly and np.allclose(points[-1], there[:2]) else None


def dear_until(costmap: CostmapView, start: Pose2, goal: Pose2, radius: float) -> float:
    """Meters from the start up to which something that a robot of this radius passes straight to the goal costs more
    than its length: 0 where nothing does, inf where it leads off the costmap.
    """
    columns, rows, left = _passed(costmap, start, goal)
    height, width = costmap.costs.shape
    if min(columns.min(), rows.min()) < 0 or columns.max() >= width or rows.max() >= height:
        return math.inf
    dear = (costmap.costs[rows, columns] != 0) | (costmap.distance[rows, columns] <= radius)
    return float(left[dear].max(initial=0.0)) * start.distance(goal)


def _passed(
    costmap: CostmapView, start: Pose2, goal: Pose2
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Column and row of each cell that the straight way leads through, and the share of the way at which it leaves it.

    Between two lines of the grid it is in one cell: that of the middle between where it crosses them.
    """
    crossed = [np.array((0.0, 1.0))]
    begin, onward = np.empty(2), np.empty(2)
    for axis, (here, there) in enumerate(((start.x, goal.x), (start.y, goal.y))):
        begin[axis] = (here - costmap.origin[axis]) / costmap.resolution
        onward[axis] = (there - here) / costmap.resolution
        first, last = sorted((begin[axis], begin[axis] + onward[axis]))
        if last > first:
            crossed.append((np.arange(math.ceil(first), math.floor(last) + 1) - begin[axis]) / onward[axis])
    at = np.sort(np.concatenate(crossed))
    middles = begin[:, None] + onward[:, None] * (0.5 * (at[1:] + at[:-1]))
    columns, rows = np.floor(middles).astype(np.int64)
    return columns, rows, at[1:]
