"""Planner over poses: Dubins and Reeds-Shepp paths for cars, SE(2) for long hulls."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.planners import OmplParameters
from simscen.stack.footprint import Footprint
from simscen.stack.path_geometry import cusps
from simscen.stack.planners.endpoints import Endpoints, find_endpoints, near, reachable_bounds
from simscen.stack.planners.pose_search import POSE_SPACING_M, DistanceLookup, Space, Valid, escape_arcs, search_poses
from simscen.stack.planners.traversal_costs import NO_INFORMATION, TraversalCosts
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel

PLANE_ONLY = ("bit_star", "aorrtc", "medial_axis")
"""Replaced by RRT-Connect over poses: there, OMPL's AORRTC (2.0.1) returns the goal alone as an exact solution."""
MIN_RADIUS_M = 0.2
"""Radius of the arcs of a long robot that could turn in place, but should not have to."""
RADIUS_RATIO = 1.15
"""Ratio of the arcs of a car to its tightest ones, so that the controller can still correct to both sides."""
CLEARANCE_M, LESS_CLEARANCE_M = 0.10, 0.05
"""Clearance beyond the hull that is kept where possible, because pose estimate and map are off by as much at times."""
SEARCHES = 6
"""Searches once there is a path, of which the best one is taken: trees over poses make detours."""
FINAL_CHECKS = 50
"""Poses per step of the path at which the hull is checked in the end."""
DEEPER_M = 0.01
"""Distance that a hull may sink further into an obstacle that it touches while it gets away."""
CUSP_M = 1.0
"""Length that a change of direction counts as: what a car could drive while it stops and steers."""


@dataclass(frozen=True)
class Attempt:
    """One attempt to find a path, in a region, with a clearance beyond the hull in m.

    It has this share of the iterations, and checks the hull every `spacing` m. The `bounds` of the region are
    (min x, min y, max x, max y).
    """

    bounds: tuple[float, float, float, float]
    contains: Callable[[float, float], bool]
    clearance: float
    share: float
    spacing: float


class PosePlanner:
    """Plans with the whole hull, which is checked at each pose as a row of discs."""

    def __init__(self, spec: OmplParameters, robot: RobotModel, footprint: Footprint, space: Space) -> None:
        self._spec, self._robot, self._footprint, self._space = spec, robot, footprint, space
        self._inscribed = robot.inscribed_radius
        self._type = "rrt_connect" if spec.type in PLANE_ONLY else spec.type
        self._turning_radius = max(RADIUS_RATIO * robot.turning_radius, MIN_RADIUS_M)

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return a path of poses in the map frame, 5 cm apart: the cheapest of a few searches."""
        costs = TraversalCosts(costmap, self._robot, self._spec.cost_travel_multiplier, self._spec.allow_unknown)
        field = DistanceLookup(costmap if self._spec.allow_unknown else self._shut(costmap))
        ends = find_endpoints(costs, start, goal, self._spec.tolerance)
        goal = self._fitting(costmap, goal, near(costs, ends.reachable, goal, self._spec.tolerance))
        away = self._led_away(costs, start)
        begin = Pose2(*away[-1].tolist())
        for attempt in self._attempts(costs, ends, begin, goal):
            valid = self._valid(field, attempt, (begin, goal))
            iterations = max(1, round(attempt.share * self._spec.max_iterations))
            found: list[Array] = []
            for _ in range(SEARCHES):
                seed += 1
                poses = search_poses(
                    self._type, self._space, self._turning_radius, attempt.bounds, begin, goal, valid, seed,
                    iterations, attempt.spacing,
                )  # fmt: skip
                if poses is None:
                    break
                found.append(np.array(poses))
            for cheapest in sorted(found, key=lambda poses: _effort(costs, poses)):
                if self._clear(costs, cheapest):
                    return Path(np.concatenate((away[:-1], cheapest)))
        message = f"{self._type}: no path in {self._spec.max_iterations} iterations"
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)

    def _attempts(self, costs: TraversalCosts, ends: Endpoints, begin: Pose2, goal: Pose2) -> Iterator[Attempt]:
        """Yield the attempts in turn: with less and less clearance, at last with finer checks."""
        bounds, reachable, size, (x0, y0) = (
            reachable_bounds(costs, ends),
            ends.reachable,
            costs.resolution,
            costs.origin,
        )
        rows, columns = reachable.shape

        def contains(x: float, y: float) -> bool:
            row, column = int((y - y0) / size), int((x - x0) / size)
            return 0 <= row < rows and 0 <= column < columns and bool(reachable[row, column])

        for clearance, share, spacing in (
            (CLEARANCE_M, 0.2, POSE_SPACING_M),
            (LESS_CLEARANCE_M, 0.2, POSE_SPACING_M),
            (0.0, 0.3, POSE_SPACING_M),
            (0.0, 0.3, POSE_SPACING_M / 10),
        ):
            yield Attempt(bounds, contains, clearance, share, spacing)

    def _clear(self, costs: TraversalCosts, poses: Array) -> bool:
        """Return whether the whole hull fits on all of the path, between the checks of the search as well."""
        part = np.arange(FINAL_CHECKS) / FINAL_CHECKS
        yaw = np.unwrap(poses[:, 2])
        unwrapped = np.column_stack((poses[:, :2], yaw))
        between = unwrapped[:-1, None] + part[:, None] * np.diff(unwrapped, axis=0)[:, None]
        whole = np.vstack((between.reshape(-1, 3), unwrapped[-1:]))
        return bool(self._footprint.free(costs.costmap, whole).all() and np.isfinite(costs.at(whole[:, :2])).all())

    def _shut(self, costmap: CostmapView) -> CostmapView:
        """Return the costmap with no room for the robot in unknown cells."""
        least = np.minimum(costmap.distance, np.float32(self._inscribed))
        return replace(costmap, distance=np.where(costmap.costs == NO_INFORMATION, least, costmap.distance))

    def _fitting(self, costmap: CostmapView, goal: Pose2, places: Iterable[tuple[float, float]]) -> Pose2:
        """Return the goal moved to the first of the places where the whole hull fits, with its heading."""
        poses = np.array([(*place, goal.yaw) for place in places])
        free = self._footprint.free(costmap, poses)
        if not free.any():
            within = f"within {self._spec.tolerance} m of the goal ({goal.x:.2f}, {goal.y:.2f})"
            raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, f"the robot does not fit {within}")
        return Pose2(*poses[free.argmax()].tolist())

    def _led_away(self, costs: TraversalCosts, start: Pose2) -> Array:
        """Return poses (n, 3) from the start to the nearest one where the whole hull fits.

        A start where it touches something is left on the shortest arc that leads no deeper.
        """
        costmap, best = costs.costmap, None
        for arc in escape_arcs(self._space, self._turning_radius, start):
            free = self._footprint.free(costmap, arc) & np.isfinite(costs.at(arc[:, :2]))
            clear = int(free.argmax())
            if not free[clear] or (best is not None and clear + 1 >= len(best)):
                continue
            rooms = self._footprint.clearance(costmap, arc[: clear + 1])
            if (rooms >= rooms[0] - DEEPER_M).all():
                best = arc[: clear + 1]
        if best is None:
            message = f"the robot does not fit at the start ({start.x:.2f}, {start.y:.2f}) nor can it get away"
            raise NavigationFailure(ErrorCode.START_OCCUPIED, message)
        return best

    def _valid(self, field: DistanceLookup, attempt: Attempt, ends: tuple[Pose2, Pose2]) -> Valid:
        """Return whether a pose is in the region and clear of obstacles; near the ends without the extra clearance."""
        offsets = self._footprint.discs.offsets.tolist()
        roomy = self._footprint.discs.radius + attempt.clearance
        sure = self._footprint.discs.radius + math.sqrt(2.0) * field.resolution  # from middle to middle of two cells
        inner = self._inscribed
        at, contains, free, costmap = field.at, attempt.contains, self._footprint.free, field.costmap

        def valid(x: float, y: float, yaw: float) -> bool:
            if not contains(x, y) or at(x, y) <= inner:
                return False
            cosine, sine = math.cos(yaw), math.sin(yaw)
            least = min(at(x + offset * cosine, y + offset * sine) for offset in offsets)
            if least <= roomy and min(math.hypot(x - end.x, y - end.y) for end in ends) > 2 * roomy:
                return False
            return least > sure or bool(free(costmap, np.array([(x, y, yaw)]))[0])

        return valid


def _effort(costs: TraversalCosts, poses: Array) -> float:
    """Return the cost of a path, with that of changes of direction."""
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    middles = 0.5 * (poses[1:, :2] + poses[:-1, :2])
    return float((steps * costs.at(middles)).sum()) + CUSP_M * int(cusps(poses).size)
