"""The planner of the reference stack: OMPL between checked ends, in the informed set, then polished."""

import math
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.navigation import ErrorCode, Path
from simscen.model.stack import OmplPlanner as PlannerSpec
from simscen.stack.planners.ends import Ends, find_ends, roomier_ends
from simscen.stack.planners.field import Field
from simscen.stack.planners.informed_set import InformedSet
from simscen.stack.planners.polish import SPACING, STRING, length, pull_tight, relaxed, spaced, with_headings
from simscen.stack.planners.search import Point, search
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel

COMFORT = 0.10
"""Metres of room around the robot that a path keeps where there is room."""
LESS_COMFORT = 0.05
"""What it keeps where COMFORT would close the way or cost a detour."""
DETOUR = 1.1
"""A roomier way may be this much longer than the tightest (ratio)."""
DETOUR_TO_TURN = 2.0
"""A way on which the robot can turn in place may be this much longer than one on which it could get stuck."""
GOOD = 1.03
"""A path no longer than this (ratio to the coarse grid's shortest) is taken at once; else the next attempt is made."""
WIDER = 0.10
"""Metres beyond the radius searched with that the elastic band tries to keep."""
BAND = 0.15
"""Metres between the points of the elastic band."""


@dataclass(frozen=True)
class Room:
    """A search for a disc of `radius` between ends where it fits, in its set of near-shortest ways."""

    ends: Ends
    radius: float
    informed: InformedSet


@dataclass(frozen=True)
class Attempt:
    """A search in the roomiest (0) or tightest (-1) of the rooms, with a share of the iterations."""

    room: int
    slack: float
    share: float


NARROW = (Attempt(0, 0.05, 0.05), Attempt(0, 0.05, 0.05), Attempt(0, 0.1, 0.1))
"""These are made until a path is GOOD; measured on houses and mazes, most plans end with the first."""
WIDE = (Attempt(-1, 0.05, 0.1), Attempt(-1, 0.15, 0.1), Attempt(-1, 1.0, 0.6))
"""These until there is a path at all: where the coarse grid took a gap for open, or the room is too tight to find."""


class OmplPlanner:
    """Plans for a disc of the robot's inscribed radius, with room around it where there is any."""

    def __init__(self, spec: PlannerSpec, robot: RobotModel) -> None:
        self._spec = spec
        self._radius, whole = robot.inscribed_radius, robot.circumscribed_radius
        wishes = [(whole + COMFORT, DETOUR), (whole + LESS_COMFORT, DETOUR)]
        if robot.radius is None:
            wishes += [(whole, DETOUR_TO_TURN), (self._radius + LESS_COMFORT, DETOUR)]
        self._wishes = tuple(wishes)

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """A path of poses in the map frame, 5 cm apart."""
        field = Field(costmap)
        tight = find_ends(field, start, goal, self._radius, self._spec.tolerance)
        points, radius = self._search(field, self._rooms(field, tight), seed)
        band = relaxed(field, spaced(np.array(points), BAND), radius, radius + WIDER)
        whole = np.vstack(((start.x, start.y), tight.start, band, tight.goal))
        return Path(with_headings(spaced(whole, SPACING), goal))

    def _rooms(self, field: Field, tight: Ends) -> list[Room]:
        """The roomiest search that costs no great detour, and the tightest; they may be the same."""
        closest = Room(tight, self._radius, InformedSet(field, tight.start, tight.goal, self._radius))
        for radius, detour in self._wishes:
            ends = roomier_ends(field, tight, radius, self._radius)
            if ends is None:
                continue
            room = Room(ends, radius, InformedSet(field, ends.start, ends.goal, radius))
            legs = math.dist(tight.start, ends.start) + math.dist(tight.goal, ends.goal)
            if room.informed.length + legs <= detour * closest.informed.length + field.resolution:
                return [room, closest]
        return [closest]

    def _search(self, field: Field, rooms: list[Room], seed: int) -> tuple[list[Point], float]:
        """The shortest path of a few attempts, and the radius it keeps."""
        best: tuple[list[Point], float] | None = None
        for number, attempt in enumerate((*NARROW, *WIDE)):
            if best is not None and number >= len(NARROW):
                break
            room = rooms[attempt.room]
            points = self._attempt(field, room, attempt, seed + number)
            if points is not None and (best is None or length(points) < length(best[0])):
                best = points, room.radius
            if best is not None and length(best[0]) <= GOOD * room.informed.length:
                break
        if best is None:
            message = f"{self._spec.type}: no path in {self._spec.max_iterations} iterations"
            raise NavigationFailure(ErrorCode.NO_VALID_PATH, message)
        return best

    def _attempt(self, field: Field, room: Room, attempt: Attempt, seed: int) -> list[Point] | None:
        """One search, and its result pulled tight."""
        start, goal, radius = room.ends.start, room.ends.goal, room.radius
        if start == goal or field.segment_free(*start, *goal, radius):
            return [start, goal]
        informed = room.informed
        stops = informed.stops(field) if attempt.slack < 1.0 else []
        points, before = [start], 0.0
        for stop, along in [*stops, (goal, math.inf)]:
            informed.narrow(attempt.slack, (before, along))
            leg = self._leg(field, room, points[-1], stop, attempt, seed)
            if leg is None:
                return None
            points, before = points + leg[1:], along
        return pull_tight(field, spaced(np.array(points), STRING).tolist(), radius)

    def _leg(
        self, field: Field, room: Room, start: Point, goal: Point, attempt: Attempt, seed: int
    ) -> list[Point] | None:
        """One search of OMPL in the informed set as it is now."""
        has, free, radius = room.informed.has, field.segment_free, room.radius

        def motion(ax: float, ay: float, bx: float, by: float) -> bool:
            middle = has(0.5 * (ax + bx), 0.5 * (ay + by))
            return middle and has(bx, by) and has(ax, ay) and free(ax, ay, bx, by, radius)

        iterations = max(1, round(attempt.share * self._spec.max_iterations))
        return search(self._spec.type, room.informed.bounds(), start, goal, motion, seed, iterations)
