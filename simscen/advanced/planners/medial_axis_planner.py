"""Planner of the advanced stack: BIT* on samples of the medial axis, followed by an optimization of the path.

The optimization places stations along the path, and several points to the left and right of each station. Viterbi's
algorithm finds the cheapest path through one point per station. The path stays on the same side of each obstacle.
"""

import math
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.advanced.planners.bit_star_searches import Leg, searches
from simscen.advanced.planners.informed_set import InformedSet
from simscen.advanced.spec import MedialAxisPlanner as PlannerSpec
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.polylines import resample_polyline
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.stack.planners.endpoints import Endpoints, find_endpoints
from simscen.stack.planners.ompl_planner import (
    FINE_SPACING_CELLS,
    Attempt,
    PosePlanner,
    state_space_for,
)
from simscen.stack.planners.ompl_search import Point
from simscen.stack.planners.path_postprocessing import SPACING_M, avoid_cell_corners, densify, smoothed, with_headings
from simscen.stack.planners.planning_window import crop_costmap, plan_in_windows
from simscen.stack.planners.pose_search import POSE_SPACING_M
from simscen.stack.planners.traversal_costs import SAMPLE_SPACING_CELLS, TraversalCosts
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner, RobotModel
from simscen.stack.setting import Setting

REFINEMENT_ROUNDS = ((0.3, 0.4, 9), (0.3, 0.2, 9), (0.25, 0.12, 7), (0.2, 0.06, 7))
"""Rounds of `refine`: distance between stations in m, maximum offset from a station in m, and points per station."""
MIN_SEGMENTS = 2
"""Minimum number of segments of a path, so that there is a station between its ends."""
Costs = npt.NDArray[np.float32]


def refine(costs: TraversalCosts, points: Array) -> Array:
    """Return an optimized and smoothed path near a path (n, 2), with the same ends."""
    points = _with_shortcuts(costs, points)
    cost = costs.along(points)
    for spacing, max_offset, count in REFINEMENT_ROUNDS:
        for stride in (costs.stride, SAMPLE_SPACING_CELLS * costs.resolution):
            other = _cheapest_through(
                costs,
                resample_polyline(points, spacing, MIN_SEGMENTS),
                np.linspace(-max_offset, max_offset, count),
                stride,
            )
            if math.isfinite(new_cost := costs.along(other)):
                break
        if new_cost < cost:
            points, cost = other, new_cost
    return smoothed(costs, points)


def _with_shortcuts(costs: TraversalCosts, points: Array) -> Array:
    """Return the path with straight shortcuts where they are not more expensive."""
    resampled = resample_polyline(points, REFINEMENT_ROUNDS[0][0], MIN_SEGMENTS)
    rows = resampled.tolist()
    cost = [0.0]
    for (ax, ay), (bx, by) in pairwise(rows):
        cost.append(cost[-1] + costs.between(ax, ay, bx, by))
    if not math.isfinite(cost[-1]):
        return points
    corners, last = [0], len(rows) - 1
    while corners[-1] < last:
        current = corners[-1]
        reachable, step = current + 1, 2
        while reachable < last:
            candidate = min(current + step, last)
            if costs.between(*rows[current], *rows[candidate]) > cost[candidate] - cost[current] + 1e-9:
                break
            reachable, step = candidate, 2 * step
        corners.append(reachable)
    return resampled[corners]


def _cheapest_through(costs: TraversalCosts, stations: Array, offsets: Array, stride: float) -> Array:
    """Return the cheapest path through one point per station, by Viterbi's algorithm.

    The points are at `offsets` m to the left of the stations (n, 2). The first and the last station have no offset.
    Costs are sampled every `stride` m.
    """
    direction = np.empty_like(stations)
    direction[1:-1] = stations[2:] - stations[:-2]
    direction[0], direction[-1] = stations[1] - stations[0], stations[-1] - stations[-2]
    direction /= np.maximum(np.hypot(direction[:, 0], direction[:, 1]), 1e-9)[:, None]
    left = np.column_stack((-direction[:, 1], direction[:, 0]))
    segment_costs = _step_costs(costs, stations[:, None] + offsets[:, None] * left[:, None], stride)
    middle = len(offsets) // 2
    lowest = np.full(len(offsets), np.inf, dtype=np.float32)
    lowest[middle] = 0.0
    predecessors, columns = [], np.arange(len(offsets))
    for step in segment_costs:
        total = lowest[:, None] + step
        predecessors.append(total.argmin(axis=0))
        lowest = total[predecessors[-1], columns]
    chosen = [middle]
    for predecessor in predecessors[::-1]:
        chosen.append(int(predecessor[chosen[-1]]))
    return stations + offsets[chosen[::-1], None] * left


def _step_costs(costs: TraversalCosts, points: Array, stride: float) -> Costs:
    """Return the costs (n - 1, k, k) from each point of a station to each point of the next one.

    `points` (n, k, 2) are the k points of n stations. Costs are sampled every `stride` m.
    """
    before = ((points[:-1] - costs.origin) / costs.resolution).astype(np.float32)[:, :, None]
    step = ((points[1:] - costs.origin) / costs.resolution).astype(np.float32)[:, None] - before
    samples = math.ceil(float(np.hypot(*(points[1:, 0] - points[:-1, 0]).T).max()) / stride)
    flat, total = costs.rates.reshape(-1), np.zeros(step.shape[:-1], dtype=np.float32)
    for sample in range(samples):
        points_between = before + np.float32((sample + 0.5) / samples) * step
        columns = np.clip(points_between[..., 0], 0, costs.width - 1).astype(np.int32)
        total += flat[np.clip(points_between[..., 1], 0, costs.height - 1).astype(np.int32) * costs.width + columns]
    lengths = np.sqrt(step[..., 0] ** 2 + step[..., 1] ** 2) * np.float32(costs.resolution / samples)
    segment_costs: Costs = total * lengths
    return segment_costs


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
        """Return poses in the map frame, at most SPACING_M apart. Raises NavigationFailure if there is no path."""
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
        self._costs = costs.reusing_cache(self._costs) if costmap.costs.size <= MAX_CACHED_CELLS else None
        return Path(with_headings(self._points(costs, start, goal, seed), goal))

    def _path_on_part(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> tuple[Array, float]:
        """Return a path (n, 2) on a part of the costmap, and its cost."""
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
                    found = self._solve(leg, seed + number)
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

    def _solve(self, leg: Leg, seed: int) -> list[Point] | None:
        """Return the points of a leg of the path; None if the search fails."""
        return leg.search(seed, self._spec.max_iterations).solve(simplify=False)


def _postprocessed(costs: TraversalCosts, points: Array) -> Array | None:
    """Return the path, refined and led around corners of blocked cells; None if it crosses a blocked cell."""
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
"""Successive attempts: slack of the informed set (`InformedSet.restrict`), ratio of the clearance to `hull_clearance`,
share of the iterations, and spacing of collision checks in m."""


class ConfinedPosePlanner(PosePlanner):
    """Plans poses with RRT-Connect, only within the informed set."""

    def _attempts(self, costs: TraversalCosts, ends: Endpoints, free_start: Pose2, goal: Pose2) -> Iterator[Attempt]:
        """Yield the ATTEMPTS."""
        informed = InformedSet(costs, (free_start.x, free_start.y), (goal.x, goal.y))
        for slack, part, fraction, spacing in ATTEMPTS:
            informed.restrict(slack)
            clearance = part * self._spec.hull_clearance
            yield Attempt(informed.bounds(), informed.contains, clearance, fraction, spacing)


MAX_COSTLY_RATIO = 0.5
"""Maximum share of a straight path that is replaced by a detour around costly cells (see `straight_path`)."""
MARGIN_BEHIND_M, MARGIN_AROUND_M = 2.0, 2.0
"""Margins of the part of the costmap in which a detour is planned: behind the costly cells, and around both ends."""
MAX_COST_RATIO = 1.01
"""Maximum ratio of the cost of a path with a detour to the straight distance."""
PlanPart = Callable[[CostmapView, Pose2], tuple[Array, float]]
"""Function that returns a path (n, 2) to a pose on a part of the costmap, and its cost. Raises NavigationFailure."""


def straight_path(costmap: CostmapView, start: Pose2, goal: Pose2, radius: float, plan_part: PlanPart) -> Array | None:
    """Return a path (n, 2) that is straight, apart from a detour by `plan_part` around costly cells near the start.

    This avoids a search of the entire costmap. None if no detour is found, or if there may be a cheaper path.
    `costly_distance` defines costly cells.
    """
    length = start.distance(goal)
    costly = costly_distance(costmap, start, goal, radius)
    if costly == 0.0:
        return np.array((start[:2], goal[:2]))
    if costly + MARGIN_BEHIND_M > MAX_COSTLY_RATIO * length:
        return None
    ratio = (costly + MARGIN_BEHIND_M) / length
    part_goal = Pose2(start.x + ratio * (goal.x - start.x), start.y + ratio * (goal.y - start.y))
    part = crop_costmap(costmap, start, part_goal, MARGIN_AROUND_M)
    if part is None:
        return None
    try:
        points, cost = plan_part(part, part_goal)
    except NavigationFailure:
        return None
    is_cheap = cost + (1.0 - ratio) * length <= MAX_COST_RATIO * length
    return np.vstack((points, goal[:2])) if is_cheap and np.allclose(points[-1], part_goal[:2]) else None


def costly_distance(costmap: CostmapView, start: Pose2, goal: Pose2, radius: float) -> float:
    """Return the distance in m from the start to the end of the last costly cell on the straight line to the goal.

    Cells are costly if they are not free or within `radius` m of an obstacle. 0 without such cells, inf if the line
    leaves the costmap.
    """
    columns, rows, leaving_ratios = _cells_on_line(costmap, start, goal)
    height, width = costmap.costs.shape
    if min(columns.min(), rows.min()) < 0 or columns.max() >= width or rows.max() >= height:
        return math.inf
    costly = (costmap.costs[rows, columns] != 0) | (costmap.distance[rows, columns] <= radius)
    return float(leaving_ratios[costly].max(initial=0.0)) * start.distance(goal)


def _cells_on_line(
    costmap: CostmapView, start: Pose2, goal: Pose2
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Return columns and rows of the cells on a straight line, and where it leaves each cell (0 start … 1 goal)."""
    crossings = [np.array((0.0, 1.0))]
    origin, direction = np.empty(2), np.empty(2)
    for axis, (start_coordinate, end) in enumerate(((start.x, goal.x), (start.y, goal.y))):
        origin[axis] = (start_coordinate - costmap.origin[axis]) / costmap.resolution
        direction[axis] = (end - start_coordinate) / costmap.resolution
        first, last = sorted((origin[axis], origin[axis] + direction[axis]))
        if last > first:
            crossings.append((np.arange(math.ceil(first), math.floor(last) + 1) - origin[axis]) / direction[axis])
    ratios = np.sort(np.concatenate(crossings))
    centers = origin[:, None] + direction[:, None] * (0.5 * (ratios[1:] + ratios[:-1]))
    columns, rows = np.floor(centers).astype(np.int64)
    return columns, rows, ratios[1:]
