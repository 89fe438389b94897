"""Planners that use OMPL: OmplPlanner searches over positions, PosePlanner over poses (position and heading)."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.planners import OmplParameters, StateSpace
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.footprint import Footprint
from simscen.stack.kinematics import cusps
from simscen.stack.planners.endpoints import Endpoints, find_endpoints, free_points, reachable_bounds, reachable_cells
from simscen.stack.planners.ompl_search import OmplSearch, Problem, set_parameters
from simscen.stack.planners.path_postprocessing import SPACING_M, avoid_cell_corners, densify, with_headings
from simscen.stack.planners.planning_window import plan_in_windows
from simscen.stack.planners.pose_search import (
    POSE_SPACING_M,
    DistanceLookup,
    PoseCheck,
    Space,
    escape_arcs,
    search_poses,
)
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import NO_INFORMATION, CostmapView, NavigationFailure, Planner, RobotModel
from simscen.stack.setting import Setting

POSITION_PLANNERS = ("bit_star", "aorrtc", "medial_axis")
"""Types of planners that search only over positions. PosePlanner uses RRT-Connect instead of these planners."""
MIN_TURNING_RADIUS_M = 0.2
"""Minimum turning radius in plans of PosePlanner, also for robots that can turn in place."""
TURNING_RADIUS_RATIO = 1.15
"""Turning radius in plans of a car, relative to its minimum. A larger radius lets the controller correct deviations."""
FINAL_CHECKS_PER_STEP = 50
"""Number of collision checks of the footprint per step of a path, after the search."""
MAX_DEEPENING_M = 0.01
"""Maximum distance by which a footprint that is in collision at the start may get deeper into the obstacle."""


@dataclass(frozen=True)
class Attempt:
    """Parameters of one attempt of PosePlanner to find a path in the reachable cells.

    bounds:              bounding box of the reachable cells (min x, min y, max x, max y) in m
    contains:            function that returns whether a point (x, y) is in a reachable cell
    clearance:           required clearance in m around the footprint
    iteration_fraction:  fraction of `max_iterations` for this attempt
    spacing:             distance in m between two collision checks
    """

    bounds: tuple[float, float, float, float]
    contains: Callable[[float, float], bool]
    clearance: float
    iteration_fraction: float
    spacing: float


class PosePlanner:
    """Planner for cars and long robots, which searches over poses and checks the footprint at each pose."""

    def __init__(self, spec: OmplParameters, robot: RobotModel, footprint: Footprint, space: Space) -> None:
        self._spec, self._robot, self._footprint, self._space = spec, robot, footprint, space
        self._inscribed = robot.inscribed_radius
        self._type = "rrt_connect" if spec.type in POSITION_PLANNERS else spec.type
        self._improving_iterations = spec.improving_iterations if isinstance(spec, PlannerSpec) else 0
        self._turning_radius = spec.minimum_turning_radius or max(
            TURNING_RADIUS_RATIO * robot.turning_radius, MIN_TURNING_RADIUS_M
        )

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return the cheapest path of several searches: poses in the map frame, at most 5 cm apart.

        Raises NavigationFailure if there is no path.
        """
        costs = TraversalCosts(costmap, self._robot, self._spec.cost_travel_multiplier, self._spec.allow_unknown)
        field = DistanceLookup(costmap if self._spec.allow_unknown else self._block_unknown(costmap))
        ends = find_endpoints(costs, start, goal, self._spec.tolerance)
        goal = self._move_goal_to_fit(costmap, goal, free_points(costs, ends.reachable, goal, self._spec.tolerance))
        escape = self._escape_path(costs, start)
        free_start = Pose2(*escape[-1].tolist())
        for attempt in self._attempts(costs, ends, free_start, goal):
            is_valid = self._make_pose_check(field, attempt, (free_start, goal))
            iterations = max(1, round(attempt.iteration_fraction * self._spec.max_iterations))
            paths: list[Array] = []
            for _ in range(self._spec.pose_searches):
                seed += 1
                poses = search_poses(
                    self._type, self._space, self._turning_radius, attempt.bounds, free_start, goal, is_valid, seed,
                    iterations, attempt.spacing, self._configure, self._improving_iterations,
                )  # fmt: skip
                if poses is None:
                    break
                paths.append(np.array(poses))
            for path in sorted(paths, key=lambda path: self._cost(costs, path)):
                if self._is_collision_free(costs, path):
                    return Path(np.concatenate((escape[:-1], path)))
        message = f"{self._type}: no path in {self._spec.max_iterations} iterations"
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)

    def _configure(self, planner: Any) -> None:
        """Set the parameters of OMPL's planner, if the specification has such parameters."""
        if isinstance(self._spec, PlannerSpec):
            set_parameters(planner, self._spec)

    def _cost(self, costs: TraversalCosts, poses: Array) -> float:
        """Return the cost of a path (n, 3), including `cusp_penalty` for each change of the driving direction."""
        steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
        midpoints = 0.5 * (poses[1:, :2] + poses[:-1, :2])
        return float((steps * costs.at(midpoints)).sum()) + self._spec.cusp_penalty * int(cusps(poses).size)

    def _attempts(self, costs: TraversalCosts, ends: Endpoints, free_start: Pose2, goal: Pose2) -> Iterator[Attempt]:
        """Yield attempts with decreasing clearance. The last attempt has finer collision checks."""
        bounds, reachable = reachable_bounds(costs, ends), ends.reachable
        size, (x0, y0) = costs.resolution, costs.origin
        rows, columns = reachable.shape

        def contains(x: float, y: float) -> bool:
            row, column = math.floor((y - y0) / size), math.floor((x - x0) / size)
            return 0 <= row < rows and 0 <= column < columns and bool(reachable[row, column])

        preferred = self._spec.hull_clearance
        for clearance, fraction, spacing in (
            (preferred, 0.2, POSE_SPACING_M),
            (0.5 * preferred, 0.2, POSE_SPACING_M),
            (0.0, 0.3, POSE_SPACING_M),
            (0.0, 0.3, POSE_SPACING_M / 10),
        ):
            yield Attempt(bounds, contains, clearance, fraction, spacing)

    def _is_collision_free(self, costs: TraversalCosts, poses: Array) -> bool:
        """Return whether a path (n, 3) is free of collisions, with finer checks than in the search."""
        fractions = np.arange(FINAL_CHECKS_PER_STEP) / FINAL_CHECKS_PER_STEP
        yaw = np.unwrap(poses[:, 2])
        unwrapped = np.column_stack((poses[:, :2], yaw))
        between = unwrapped[:-1, None] + fractions[:, None] * np.diff(unwrapped, axis=0)[:, None]
        checked = np.vstack((between.reshape(-1, 3), unwrapped[-1:]))
        return bool(self._footprint.free(costs.costmap, checked).all() and np.isfinite(costs.at(checked[:, :2])).all())

    def _block_unknown(self, costmap: CostmapView) -> CostmapView:
        """Return a copy of the costmap in which unknown cells are too close to an obstacle."""
        limited = np.minimum(costmap.distance, np.float32(self._inscribed))
        return replace(costmap, distance=np.where(costmap.costs == NO_INFORMATION, limited, costmap.distance))

    def _move_goal_to_fit(self, costmap: CostmapView, goal: Pose2, points: Iterable[tuple[float, float]]) -> Pose2:
        """Return the goal, moved to the first point at which the footprint fits. Raises GOAL_OCCUPIED if none fits."""
        poses = np.array([(*point, goal.yaw) for point in points])
        free = self._footprint.free(costmap, poses)
        if not free.any():
            within = f"within {self._spec.tolerance} m of the goal ({goal.x:.2f}, {goal.y:.2f})"
            raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, f"the robot does not fit {within}")
        return Pose2(*poses[free.argmax()].tolist())

    def _escape_path(self, costs: TraversalCosts, start: Pose2) -> Array:
        """Return poses (n, 3) on the shortest arc from the start to a pose at which the footprint fits.

        The arc must not lead deeper into an obstacle. Raises START_OCCUPIED if no arc does this.
        """
        costmap, best = costs.costmap, None
        for arc in escape_arcs(self._space, self._turning_radius, start):
            free = self._footprint.free(costmap, arc) & np.isfinite(costs.at(arc[:, :2]))
            first_free = int(free.argmax())
            if not free[first_free] or (best is not None and first_free + 1 >= len(best)):
                continue
            clearances = self._footprint.clearance(costmap, arc[: first_free + 1])
            if (clearances >= clearances[0] - MAX_DEEPENING_M).all():
                best = arc[: first_free + 1]
        if best is None:
            message = f"the robot does not fit at the start ({start.x:.2f}, {start.y:.2f}) and cannot get away from it"
            raise NavigationFailure(ErrorCode.START_OCCUPIED, message)
        return best

    def _make_pose_check(self, field: DistanceLookup, attempt: Attempt, ends: tuple[Pose2, Pose2]) -> PoseCheck:
        """Return a function that checks that a pose is reachable, free of collisions, and has the attempt's clearance.

        Near start and goal (`ends`), no clearance is required.
        """
        offsets = self._footprint.discs.offsets.tolist()
        required = self._footprint.discs.radius + attempt.clearance
        # Distances are between cell centers, and therefore wrong by up to a cell diagonal.
        certainly_free = self._footprint.discs.radius + math.sqrt(2.0) * field.resolution
        inscribed = self._inscribed
        distance_of, contains, free, costmap = field.distance, attempt.contains, self._footprint.free, field.costmap

        def is_valid(x: float, y: float, yaw: float) -> bool:
            if not contains(x, y) or distance_of(x, y) <= inscribed:
                return False
            cosine, sine = math.cos(yaw), math.sin(yaw)
            distance = min(distance_of(x + offset * cosine, y + offset * sine) for offset in offsets)
            if distance <= required and min(math.hypot(x - end.x, y - end.y) for end in ends) > 2 * required:
                return False
            return distance > certainly_free or bool(free(costmap, np.array([(x, y, yaw)]))[0])

        return is_valid


FINE_SPACING_CELLS = 0.125
"""Spacing of collision checks in the searches after a search whose path crosses a blocked cell."""
MAX_SEARCHES = 4
"""Maximum number of searches, each with a different seed, before planning fails."""
REPEATED_REWIRE_FACTOR = 1.6
"""Default `rewire_factor` after a search without a path. It permits longer motions, which find narrow gaps."""


class OmplPlanner:
    """Planner for robots that are neither cars nor long, which searches over positions of the inscribed circle."""

    def __init__(self, spec: PlannerSpec, robot: RobotModel) -> None:
        self._spec, self._robot = spec, robot

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return a path of poses in the map frame, at most 5 cm apart. Raises NavigationFailure if there is no path."""
        return plan_in_windows(self._plan, costmap, start, goal, seed)

    def _plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return the path on a costmap or on a window of it."""
        costs = TraversalCosts(costmap, self._robot, self._spec.cost_travel_multiplier, self._spec.allow_unknown)
        ends = find_endpoints(costs, start, goal, self._spec.tolerance)
        costs, ends = self._avoid_narrow_gaps(costs, ends)
        points = np.array([ends.start]) if ends.start == ends.goal else self._search(costs, ends, seed)
        points = densify(np.vstack(((start.x, start.y), points)), SPACING_M)
        return Path(with_headings(points, goal))

    def _avoid_narrow_gaps(self, costs: TraversalCosts, ends: Endpoints) -> tuple[TraversalCosts, Endpoints]:
        """Return costs and endpoints with blocked narrow gaps; without this change if the goal is then unreachable."""
        if self._spec.gap_clearance == 0.0:
            return costs, ends
        wide = costs.without_narrow_gaps(self._spec.gap_clearance, (ends.start, ends.goal))
        reachable = reachable_cells(wide, ends.start)
        return (wide, replace(ends, reachable=reachable)) if reachable[wide.cell(ends.goal)] else (costs, ends)

    def _search(self, costs: TraversalCosts, ends: Endpoints, seed: int) -> Array:
        """Return the points (n, 2) of a path that crosses no blocked cell. Raises NO_VALID_PATH."""
        spec, problem = self._spec, make_problem(costs, ends)
        repeated = spec if spec.rewire_factor else spec.model_copy(update={"rewire_factor": REPEATED_REWIRE_FACTOR})
        for number in range(MAX_SEARCHES):
            points = OmplSearch(spec, problem, seed + number).solve(simplify=spec.simplify)
            if points is None:
                spec = repeated
                continue
            path = avoid_cell_corners(costs, densify(np.array(points), SPACING_M))
            if path is not None:
                return path
            costs.stride = FINE_SPACING_CELLS * costs.resolution
        message = f"{spec.type}: no path in {MAX_SEARCHES} searches of {spec.max_iterations} iterations"
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)


def make_problem(costs: TraversalCosts, ends: Endpoints) -> Problem:
    """Return the problem for OmplSearch, within the bounding box of the reachable cells."""
    return Problem(ends.start, ends.goal, reachable_bounds(costs, ends), costs.between)


LONG_HULL_RATIO = 2.0
"""Ratio of circumscribed to inscribed radius above which a robot is long, so that plans include the heading."""


def ompl_planner(spec: PlannerSpec, setting: Setting) -> Planner:
    """Build the planner for the robot: OmplPlanner for positions, PosePlanner for poses."""
    space = state_space_for(spec.state_space, setting.robot)
    if space == "holonomic":
        return OmplPlanner(spec, setting.robot)
    return PosePlanner(spec, setting.robot, setting.footprint, space)


def state_space_for(requested: StateSpace, robot: RobotModel) -> Literal["holonomic", "se2", "dubins", "reeds_shepp"]:
    """Return the state space to plan in. "holonomic" means positions only.

    "auto" means "reeds_shepp" for a car, "se2" for a long robot, and otherwise "holonomic". If the robot cannot move
    sideways, "se2" is replaced by "dubins".
    """
    space = requested
    if space == "auto":
        if robot.turning_radius > 0.0:
            space = "reeds_shepp"
        else:
            space = "se2" if robot.circumscribed_radius > LONG_HULL_RATIO * robot.inscribed_radius else "holonomic"
    return "dubins" if space == "se2" and not robot.holonomic else space
