"""The planner of the reference stack: OMPL between checked ends, then polished."""

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.navigation import ErrorCode, Path
from simscen.model.stack import Planner as PlannerSpec
from simscen.stack.planners.ends import Ends, find_ends, roomier_ends
from simscen.stack.planners.field import Field
from simscen.stack.planners.polish import SPACING, pull_tight, relaxed, spaced, with_headings
from simscen.stack.planners.search import Point, search
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel

COMFORT = 0.10
"""Metres of room beyond the inscribed radius that a path keeps where there is room."""
SQUEEZES = (COMFORT, 0.05, 0.0)
"""Room that is tried to be kept, in this order."""


class OmplPlanner:
    """Plans for a disc of the robot's inscribed radius, first with some room around it."""

    def __init__(self, spec: PlannerSpec, robot: RobotModel) -> None:
        self._spec = spec
        self._radius = robot.inscribed_radius

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """A path of poses in the map frame, 5 cm apart."""
        field = Field(costmap)
        tight = find_ends(field, start, goal, self._radius, self._spec.tolerance)
        ends, radius = self._roomiest(field, tight)
        found = self._search(field, ends.start, ends.goal, radius, seed)
        pulled = pull_tight(field, spaced(np.array(found), 0.25).tolist(), radius)
        band = relaxed(field, spaced(np.array(pulled), 0.15), radius, self._radius + COMFORT + field.resolution)
        whole = np.vstack(((start.x, start.y), tight.start, band, tight.goal))
        return Path(with_headings(spaced(whole, SPACING), goal))

    def _roomiest(self, field: Field, tight: Ends) -> tuple[Ends, float]:
        for room in SQUEEZES[:-1]:
            ends = roomier_ends(field, tight, self._radius + room, self._radius)
            if ends is not None:
                return ends, self._radius + room
        return tight, self._radius

    def _search(self, field: Field, start: Point, goal: Point, radius: float, seed: int) -> list[Point]:
        if start == goal or field.segment_free(*start, *goal, radius):
            return [start, goal]
        low = field.origin
        high = (low[0] + field.width * field.resolution, low[1] + field.height * field.resolution)
        found = search(
            self._spec.type,
            (*low, *high),
            start,
            goal,
            lambda ax, ay, bx, by: field.segment_free(ax, ay, bx, by, radius),
            seed,
            self._spec.max_iterations,
        )
        if found is None:
            raise NavigationFailure(
                ErrorCode.NO_VALID_PATH, f"{self._spec.type}: no path in {self._spec.max_iterations} iterations"
            )
        return found
