"""Plans poses rather than points: Dubins and Reeds-Shepp paths for cars, SE(2) for long hulls."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.navigation import ErrorCode, Path
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.cusps import cusps
from simscen.stack.footprint import Footprint
from simscen.stack.planners.ends import find_ends
from simscen.stack.planners.field import Field
from simscen.stack.planners.informed_set import InformedSet
from simscen.stack.planners.pose_search import Space, Valid, search_poses
from simscen.stack.planners.rates import Rates
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel

TIGHTEST = 0.2
"""Metres: the arcs of a long robot that could turn in place, but should not have to."""
ROOM_TO_STEER = 1.15
"""A car's arcs are this much wider than its tightest: at full lock a controller has nothing left to correct with."""
ROOM, LESS_ROOM = 0.10, 0.05
"""Metres beyond the hull that are kept where that is possible: belief and map are off by as much at times."""
ATTEMPTS = (
    (0.15, ROOM, 0.1),
    (0.3, ROOM, 0.1),
    (0.15, LESS_ROOM, 0.1),
    (0.3, LESS_ROOM, 0.1),
    (0.3, 0.0, 0.2),
    (2.0, 0.0, 0.4),
)
"""Slack of the informed set, room, share of the iterations. Cars need wider sets than discs: they swing out."""
TRIES = 6
"""Searches in all once there is a path: trees over poses make detours, and each takes only milliseconds."""
CUSP = 1.0
"""Metres that a change of direction counts as: about what a car could drive while it stops and steers round."""


class PosePlanner:
    """Checks the whole hull at each pose, as a row of discs."""

    def __init__(self, spec: PlannerSpec, robot: RobotModel, footprint: Footprint, space: Space) -> None:
        self._spec, self._robot, self._footprint, self._space = spec, robot, footprint, space
        self._inscribed = robot.inscribed_radius
        self._type = "rrt_connect" if spec.type == "bit_star" else spec.type
        self._turning_radius = max(ROOM_TO_STEER * robot.turning_radius, TIGHTEST)

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """A path of poses in the map frame, 5 cm apart; the easiest of a few searches."""
        field = Field(costmap)
        rates = Rates(costmap, self._robot, self._spec.cost_travel_multiplier, self._spec.allow_unknown)
        ends = find_ends(rates, start, goal, self._spec.tolerance)
        self._hull_fits(costmap, start, ErrorCode.START_OCCUPIED, "start")
        goal = Pose2(*ends.goal, goal.yaw)
        self._hull_fits(costmap, goal, ErrorCode.GOAL_OCCUPIED, "goal")
        informed = InformedSet(rates, ends.start, ends.goal)
        for slack, room, share in ATTEMPTS:
            informed.narrow(slack)
            valid = self._valid(field, informed, room, (start, goal))
            iterations = max(1, round(share * self._spec.max_iterations))
            found: list[Array] = []
            while True:
                seed += 1
                poses = search_poses(
                    self._type, self._space, self._turning_radius, informed.bounds(), start, goal, valid, seed,
                    iterations,
                )  # fmt: skip
                if poses is None:
                    break
                found.append(np.array(poses))
                if len(found) == TRIES:
                    break
            if found:
                return Path(min(found, key=lambda poses: _effort(rates, poses)))
        message = f"{self._type}: no path in {self._spec.max_iterations} iterations"
        raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)

    def _hull_fits(self, costmap: CostmapView, pose: Pose2, code: ErrorCode, what: str) -> None:
        if not self._footprint.free(costmap, np.array([pose]))[0]:
            raise NavigationFailure(code, f"the robot does not fit at the {what} ({pose.x:.2f}, {pose.y:.2f})")

    def _valid(self, field: Field, informed: InformedSet, room: float, ends: tuple[Pose2, Pose2]) -> Valid:
        """Whether a pose is in the informed set and clear of obstacles; near the ends without the extra room."""
        offsets = self._footprint.discs.offsets.tolist()
        tight, roomy = self._footprint.discs.radius, self._footprint.discs.radius + room
        inner = self._inscribed
        at, has, free, costmap = field.at, informed.has, self._footprint.free, field.costmap

        def valid(x: float, y: float, yaw: float) -> bool:
            if not has(x, y) or at(x, y) <= inner:
                return False
            cosine, sine = math.cos(yaw), math.sin(yaw)
            least = min(at(x + offset * cosine, y + offset * sine) for offset in offsets)
            if least > roomy:
                return True
            if min(math.hypot(x - end.x, y - end.y) for end in ends) > 2 * roomy:
                return False
            return least > tight or bool(free(costmap, np.array([(x, y, yaw)]))[0])

        return valid


def _effort(rates: Rates, poses: Array) -> float:
    """What the way costs, and what stopping to change direction does."""
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    middles = 0.5 * (poses[1:, :2] + poses[:-1, :2])
    return float((steps * rates.at(middles)).sum()) + CUSP * int(cusps(poses).size)
