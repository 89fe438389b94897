"""Contract of planners: checks that every planner must pass."""

from __future__ import annotations

from functools import cache

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner, RobotModel
from simscen.testing.contracts.base import (
    ComponentContract,
    are_equal_costmaps,
    call_component,
    copy_costmap,
    costmap_of_world,
    overwrite_costmap,
    promise,
    require,
)
from simscen.testing.flatland import Flatland

START, GOAL = Pose2(1.5, 1.5, 0.3), Pose2(10.0, 5.5, 0.5)
MAX_POINT_SPACING_M = 0.1
"""Maximum distance between consecutive points of a path."""
IMPOSSIBLE_REQUESTS = (
    (Pose2(-3, 1), GOAL, ErrorCode.START_OUTSIDE_MAP),
    (START, Pose2(30, 1), ErrorCode.GOAL_OUTSIDE_MAP),
    (Pose2(4.05, 1), GOAL, ErrorCode.START_OCCUPIED),
    (START, Pose2(8.05, 5), ErrorCode.GOAL_OCCUPIED),
    (START, Pose2(15, 3.5), ErrorCode.NO_VALID_PATH),
)
"""(start, goal, expected error code) of requests that no planner can fulfill."""


@cache
def house() -> Flatland:
    """Return a world of 12 m by 7 m with two inner walls, a cupboard, and a closed room outside."""
    room = Flatland().room(12, 7)
    room.boxes += [(4.0, 0.0, 4.1, 4.5), (8.0, 2.5, 8.1, 7.0), (14.0, 1.0, 16.0, 1.1), (14.0, 1.0, 14.1, 6.0)]
    room.boxes += [(14.0, 5.9, 16.0, 6.0), (15.9, 1.0, 16.0, 6.0), (1.0, 5.0, 2.5, 6.0)]
    return room


@cache
def _house_costmap(robot: RobotModel) -> CostmapView:
    return costmap_of_world(house(), robot, (-0.5, -0.5, 17.0, 7.5))


class PlannerContract(ComponentContract):
    """Contract of a planner in `house()`."""

    role = "planner"

    def view(self) -> CostmapView:
        """Return a copy of the costmap of the house."""
        return copy_costmap(_house_costmap(self.robot))

    def plan(
        self, planner: Planner, view: CostmapView, seed: int, start_and_goal: tuple[Pose2, Pose2] = (START, GOAL)
    ) -> Array:
        """Return the points (n, 3) of a plan. Raises PromiseBroken if the result is not a Path with finite points."""
        path = call_component("plans", lambda: planner.plan(view, *start_and_goal, seed))
        require(isinstance(path, Path), f"returns {type(path).__name__}, not a Path")
        points = path.points
        require(isinstance(points, np.ndarray) and points.ndim == 2 and points.shape[1] == 3, "points are not (n, 3)")
        require(len(points) > 0, "returns a path without points instead of failing with NO_VALID_PATH")
        require(points.dtype == np.float64 and np.isfinite(points).all(), "points are not finite float64 numbers")
        return points

    @promise
    def success_begins_at_the_start_and_ends_near_the_goal(self) -> None:
        """Given a reachable goal then the path begins at the start and ends within the tolerance of the goal."""
        for seed in (1, 2, 3):
            points = self.plan(self.build(), self.view(), seed)
            offset = float(np.hypot(*(points[0, :2] - START[:2])))
            require(offset < 1e-9, f"the path begins {offset:.3f} m from the start")
            offset = float(np.hypot(*(points[-1, :2] - GOAL[:2])))
            require(
                offset <= self.spec.tolerance,
                f"the path ends {offset:.3f} m from the goal, tolerance {self.spec.tolerance:g}",
            )

    @promise
    def points_are_at_most_a_tenth_of_a_meter_apart(self) -> None:
        """Given a path then consecutive points are at most 0.1 m apart."""
        max_gap = float(np.hypot(*np.diff(self.plan(self.build(), self.view(), 1)[:, :2], axis=0).T).max(initial=0.0))
        require(max_gap <= MAX_POINT_SPACING_M + 1e-9, f"two points are {max_gap:.3f} m apart")

    @promise
    def the_footprint_is_never_on_a_lethal_cell(self) -> None:
        """Given a path then the footprint touches no lethal cell at any point after the start."""
        footprint = Footprint(self.robot, 0.05)
        for seed in (1, 2, 3):
            view = self.view()
            points = self.plan(self.build(), view, seed)
            in_collision = ~footprint.free(view, points)
            in_collision[0] = False
            pose = points[in_collision.argmax()].round(3).tolist()
            require(not in_collision.any(), f"the robot is in collision at {pose} (x, y, yaw)")

    @promise
    def an_impossible_request_fails_with_its_error_code(self) -> None:
        """Given a request without a solution then the planner fails with the error code of IMPOSSIBLE_REQUESTS."""
        for start, goal, code in IMPOSSIBLE_REQUESTS:
            try:
                self.plan(self.build(), self.view(), 1, (start, goal))
            except NavigationFailure as failure:
                require(failure.code == code, f"fails with {failure.code.name}, not with {code.name}")
            else:
                require(False, f"finds a path instead of failing with {code.name}")

    @promise
    def the_same_seed_gives_the_same_path_bit_for_bit_whatever_was_planned_before(self) -> None:
        """Given the same arguments and seed then the paths are bit-identical, independent of earlier calls."""
        first = self.plan(self.build(), self.view(), 7)
        other = self.build()
        self.plan(other, self.view(), 3, (GOAL, START))
        require(np.array_equal(self.plan(other, self.view(), 7), first), "two paths from the same seed differ")

    @promise
    def a_costmap_is_neither_changed_nor_kept(self) -> None:
        """Given a costmap then the planner does not change it, and later changes of it do not affect later plans."""
        planner, view, untouched = self.build(), self.view(), self.view()
        first = self.plan(planner, view, 1)
        require(are_equal_costmaps(view, untouched), "changes the costmap")
        original = first.copy()
        overwrite_costmap(view)
        require(np.array_equal(self.plan(planner, untouched, 1), original), "an old costmap affects a new plan")
        require(np.array_equal(first, original), "a path changes after it was returned")
