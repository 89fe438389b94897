"""Plans poses rather than points: Dubins and Reeds-Shepp paths for cars, SE(2) for long hulls."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.cusps import cusps
from simscen.stack.footprint import Footprint
from simscen.stack.planners.ends import find_ends, near
from simscen.stack.planners.escapes import escapes
from simscen.stack.planners.field import Field
from simscen.stack.planners.informed_set import InformedSet
from simscen.stack.planners.pose_search import SPACING, Space, Valid, search_poses
from simscen.stack.planners.rates import NO_INFORMATION, Rates
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel

PLANE_ONLY = ("bit_star", "aorrtc")
"""RRT-Connect stands in for them: over poses OMPL's AORRTC (2.0.1) calls a path of the goal alone an exact solution."""
TIGHTEST = 0.2
"""Meters: the arcs of a long robot that could turn in place, but should not have to."""
ROOM_TO_STEER = 1.15
"""A car's arcs are this much wider than its tightest: at full lock a controller has nothing left to correct with."""
ROOM, LESS_ROOM = 0.10, 0.05
"""Meters beyond the hull that are kept where that is possible: belief and map are off by as much at times."""
ATTEMPTS = (
    (0.15, ROOM, 0.1, SPACING),
    (0.3, ROOM, 0.1, SPACING),
    (0.15, LESS_ROOM, 0.1, SPACING),
    (0.3, LESS_ROOM, 0.1, SPACING),
    (0.3, 0.0, 0.2, SPACING),
    (2.0, 0.0, 0.4, SPACING),
    (2.0, 0.0, 0.4, SPACING / 10),
)
"""Slack of the informed set, room, share of the iterations, meters between looks. Cars need wider sets than discs: they
swing out."""
TRIES = 6
"""Searches in all once there is a path: trees over poses make detours, and each takes only milliseconds."""
LOOKS = 50
"""Poses from one of an answer to the next at which the hull is looked at in the end."""
DEEPER = 0.01
"""Meters that a hull may sink further into what it touches while it gets away: the costmap tells no less."""
CUSP = 1.0
"""Meters that a change of direction counts as: about what a car could drive while it stops and steers round."""


class PosePlanner:
    """Checks the whole hull at each pose, as a row of discs."""

    def __init__(self, spec: PlannerSpec, robot: RobotModel, footprint: Footprint, space: Space) -> None:
        self._spec, self._robot, self._footprint, self._space = spec, robot, footprint, space
        self._inscribed = robot.inscribed_radius
        self._type = "rrt_connect" if spec.type in PLANE_ONLY else spec.type
        self._turning_radius = max(ROOM_TO_STEER * robot.turning_radius, TIGHTEST)

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """A path of poses in the map frame, 5 cm apart; the easiest of a few searches."""
        rates = Rates(costmap, self._robot, self._spec.cost_travel_multiplier, self._spec.allow_unknown)
        field = Field(costmap if self._spec.allow_unknown else self._shut(costmap))
        ends = find_ends(rates, start, goal, self._spec.tolerance)
        goal = self._fitting(costmap, goal, near(rates, ends.reachable, goal, self._spec.tolerance))
        away = self._led_away(rates, start)
        begin = Pose2(*away[-1].tolist())
        informed = InformedSet(rates, (begin.x, begin.y), (goal.x, goal.y))
        for slack, room, share, looks in ATTEMPTS:
            informed.narrow(slack)
            valid = self._valid(field, informed, room, (begin, goal))
            iterations = max(1, round(share * self._spec.max_iterations))
            found: list[Array] = []
            for _ in range(TRIES):
                seed += 1
                poses = search_poses(
                    self._type, self._space, self._turning_radius, informed.bounds(), begin, goal, valid, seed,
                    iterations, looks,
                )  # fmt: skip
                if poses is None:
                    break
                found.append(np.array(poses))
            for easiest in sorted(found, key=lambda poses: _effort(rates, poses)):
                if self._clear(rates, easiest):
                    return Path(np.concatenate((away[:-1], easiest)))
        message = f"{self._type}: no path in {self._spec.max_iterations} iterations"
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)

    def _clear(self, rates: Rates, poses: Array) -> bool:
        """Whether the whole hull has room on all of the way: a search looks at it every 5 cm."""
        part = np.arange(LOOKS) / LOOKS
        yaw = np.unwrap(poses[:, 2])
        unwrapped = np.column_stack((poses[:, :2], yaw))
        between = unwrapped[:-1, None] + part[:, None] * np.diff(unwrapped, axis=0)[:, None]
        whole = np.vstack((between.reshape(-1, 3), unwrapped[-1:]))
        return bool(self._footprint.free(rates.costmap, whole).all() and np.isfinite(rates.at(whole[:, :2])).all())

    def _shut(self, costmap: CostmapView) -> CostmapView:
        """The costmap with no room for the robot where nothing is known."""
        least = np.minimum(costmap.distance, np.float32(self._inscribed))
        return replace(costmap, distance=np.where(costmap.costs == NO_INFORMATION, least, costmap.distance))

    def _fitting(self, costmap: CostmapView, goal: Pose2, places: Iterable[tuple[float, float]]) -> Pose2:
        """The goal at the first of the places where the whole hull fits, with its heading kept."""
        poses = np.array([(*place, goal.yaw) for place in places])
        free = self._footprint.free(costmap, poses)
        if not free.any():
            within = f"within {self._spec.tolerance} m of the goal ({goal.x:.2f}, {goal.y:.2f})"
            raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, f"the robot does not fit {within}")
        return Pose2(*poses[free.argmax()].tolist())

    def _led_away(self, rates: Rates, start: Pose2) -> Array:
        """Poses (n, 3) from the start to the nearest one where the whole hull fits: the start alone if it fits there.

        A start where it touches something is left on the shortest arc that leads no deeper.
        """
        costmap, best = rates.costmap, None
        for arc in escapes(self._space, self._turning_radius, start):
            free = self._footprint.free(costmap, arc) & np.isfinite(rates.at(arc[:, :2]))
            clear = int(free.argmax())
            if not free[clear] or (best is not None and clear + 1 >= len(best)):
                continue
            rooms = self._footprint.clearance(costmap, arc[: clear + 1])
            if (rooms >= rooms[0] - DEEPER).all():
                best = arc[: clear + 1]
        if best is None:
            message = f"the robot does not fit at the start ({start.x:.2f}, {start.y:.2f}) nor can it get away"
            raise NavigationFailure(ErrorCode.START_OCCUPIED, message)
        return best

    def _valid(self, field: Field, informed: InformedSet, room: float, ends: tuple[Pose2, Pose2]) -> Valid:
        """Whether a pose is in the informed set and clear of obstacles; near the ends without the extra room."""
        offsets = self._footprint.discs.offsets.tolist()
        roomy = self._footprint.discs.radius + room
        sure = self._footprint.discs.radius + math.sqrt(2.0) * field.resolution  # from middle to middle of two cells
        inner = self._inscribed
        at, has, free, costmap = field.at, informed.has, self._footprint.free, field.costmap

        def valid(x: float, y: float, yaw: float) -> bool:
            if not has(x, y) or at(x, y) <= inner:
                return False
            cosine, sine = math.cos(yaw), math.sin(yaw)
            least = min(at(x + offset * cosine, y + offset * sine) for offset in offsets)
            if least <= roomy and min(math.hypot(x - end.x, y - end.y) for end in ends) > 2 * roomy:
                return False
            return least > sure or bool(free(costmap, np.array([(x, y, yaw)]))[0])

        return valid


def _effort(rates: Rates, poses: Array) -> float:
    """What the way costs, and what stopping to change direction does."""
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    middles = 0.5 * (poses[1:, :2] + poses[:-1, :2])
    return float((steps * rates.at(middles)).sum()) + CUSP * int(cusps(poses).size)
