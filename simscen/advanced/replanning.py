"""Replanning of the advanced stack: additional reasons for a new plan, and plans with more clearance."""

import contextlib

import numpy as np

from simscen.advanced.predicted_costs import add_predicted_costs, meets_moving_obstacle
from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Path
from simscen.core.records.events import Event
from simscen.stack.followed_plan import WATCH_DISTANCE_M, FollowedPlan
from simscen.stack.footprint import distances
from simscen.stack.plan_manager import PlanManager, PlanResult
from simscen.stack.protocols import CostmapView, NavigationFailure

MIN_PLAN_AGE_S = 0.5
"""Minimum age of a plan that is checked for lost clearance."""
SHORTCUT_PERIOD_S = 2.0
"""Time between two checks for a shorter path after obstacles have disappeared."""
MOVING_PERIOD_S = 0.5
"""Minimum time between two plans around moving obstacles."""
CAUTIOUS_CLEARANCES_M = (0.10, 0.05)
"""Clearances added to the robot's radius, tried in this order, after the controller could not follow a plan."""
PREFERRED_CLEARANCE_M, MAX_DETOUR_RATIO = 0.15, 1.15
"""A path with the added clearance PREFERRED_CLEARANCE_M is preferred if it is at most MAX_DETOUR_RATIO times as long as
the path with a cautious clearance."""
MAX_VARYING_CELLS = 8
"""Number of obstacle cells that vary with lidar noise. If more cells become free, a shorter path is searched."""
MAX_LENGTH_RATIO, MIN_SAVING_M = 0.85, 0.5
"""Maximum length of a shorter path relative to the rest of the current plan, and minimum length that it saves."""
LOST_CLEARANCE_M = 0.1
"""Decrease of a plan's clearance after which the plan is replaced."""
CLEARANCE_HORIZON_M = 4.0
"""Length of the plan ahead of the robot on which clearance is checked."""


class ClearancePlan(FollowedPlan):
    """Followed plan that compares its present clearance with its clearance at the time of planning."""

    def __init__(self, path: Path, radius: float, costmap: CostmapView) -> None:
        self._initial_clearance = np.minimum(distances(costmap, path.points[:, :2]), np.float32(WATCH_DISTANCE_M))
        super().__init__(path, radius, costmap)

    def update_occupied(self, costmap: CostmapView) -> None:
        """Determine which points of the plan are occupied, and which have lost clearance."""
        clearance = distances(costmap, self.path.points[:, :2])
        self._occupied = clearance <= np.float32(self._radius)
        min_clearance = self._initial_clearance - np.float32(LOST_CLEARANCE_M)
        self._has_lost = np.minimum(clearance, np.float32(WATCH_DISTANCE_M)) < min_clearance

    def has_lost_clearance(self) -> bool:
        """Return whether the plan has lost LOST_CLEARANCE_M of clearance within the next CLEARANCE_HORIZON_M."""
        tracker = self._updated_tracker
        if not self._has_lost.any():
            return False
        along, index = tracker.path_lengths, tracker.index
        end = int(np.searchsorted(along, along[index] + CLEARANCE_HORIZON_M, side="right"))
        return bool(self._has_lost[index:end].any())

    def is_longer_than(self, length: float) -> bool:
        """Return whether a path of `length` m is shorter than the rest of this plan by more than a hysteresis."""
        remaining_length = self.remaining()
        return length < MAX_LENGTH_RATIO * remaining_length and length < remaining_length - MIN_SAVING_M


class AdvancedPlanManager(PlanManager):
    """Plan manager that plans around moving obstacles.

    With `replanning: on_invalid`, it replans if the plan is blocked, ends at the edge of a rolling costmap that moved,
    meets a moving obstacle, has lost clearance, or may be unnecessarily long. Most private methods are hooks that
    PlanManager calls.
    """

    plan: ClearancePlan | None

    def reset(self, now: float) -> None:
        """Prepare for a new goal."""
        super().reset(now)
        self._checked_revision, self._max_obstacle_cells = -1, 0
        self._avoids_moving, self._moving_replanned_at = False, now
        self._is_cautious = False

    def report_control_failure(self) -> None:
        """With `cautious`, keep more clearance in plans until the next goal, because control has failed."""
        self._is_cautious = self._spec.cautious

    def _scheduled_reason(self, now: float, plan: FollowedPlan) -> str:
        if self._spec.replanning == "rate":
            return super()._scheduled_reason(now, plan)
        if self._costmap.revision == self._checked_revision:
            return ""
        if self._is_blocked(plan):
            return "blocked"
        return "window" if self._is_partial and self._costmap.view.origin != self._origin else ""

    def _optional_reason(self, now: float, goal: Goal, pose: Pose2, plan: FollowedPlan) -> str:
        if self._spec.replanning == "rate":
            return ""
        assert isinstance(plan, ClearancePlan)
        if self._should_avoid_moving(now, pose, plan):
            return "moving"
        if self._costmap.revision != self._checked_revision:
            self._checked_revision = self._costmap.revision
            self._max_obstacle_cells = max(self._max_obstacle_cells, self._costmap.obstacle_cell_count)
            if now - self._adopted_at >= MIN_PLAN_AGE_S and plan.has_lost_clearance():
                return "tight"
        if now - self._scheduled_at < SHORTCUT_PERIOD_S:
            return ""
        self._scheduled_at, cells = now, self._costmap.obstacle_cell_count
        disappeared = cells < self._max_obstacle_cells - MAX_VARYING_CELLS
        self._max_obstacle_cells = cells if disappeared else max(self._max_obstacle_cells, cells)
        can_be_shorter = self._is_partial or plan.is_longer_than(pose.distance(goal.pose) - goal.xy_tolerance)
        return "better" if disappeared and can_be_shorter else ""

    def _should_avoid_moving(self, now: float, pose: Pose2, plan: FollowedPlan) -> bool:
        """Return whether to replan: the plan meets a moving obstacle, or avoids one that may have moved away."""
        moving = self._costmap.moving
        if not (self._avoids_moving or len(moving)) or now - self._moving_replanned_at < MOVING_PERIOD_S:
            return False
        if not self._avoids_moving and not meets_moving_obstacle(
            moving, pose, plan.sampled_points(4), self._speed, self._radius
        ):
            return False
        self._moving_replanned_at = now
        return True

    def _accepts(self, reason: str, result: PlanResult) -> bool:
        return reason != "better" or (self.plan is not None and self.plan.is_longer_than(result.path.length()))

    def _planning_view(self, pose: Pose2) -> CostmapView:
        return add_predicted_costs(self._costmap.view, pose, self._speed, self._radius)

    def _plan_leg(self, view: CostmapView, start: Pose2, goal: Pose2, tolerance: float, seed: int) -> Path:
        for clearance in CAUTIOUS_CLEARANCES_M if self._is_cautious else ():
            with contextlib.suppress(NavigationFailure):
                path = super()._plan_leg(view.with_grown_obstacles(clearance), start, goal, tolerance, seed)
                return self._with_preferred_clearance(path, view, start, goal, tolerance, seed)
        return super()._plan_leg(view, start, goal, tolerance, seed)

    def _with_preferred_clearance(
        self, path: Path, view: CostmapView, start: Pose2, goal: Pose2, tolerance: float, seed: int
    ) -> Path:
        """Return a path with the preferred clearance if it is not much longer, otherwise `path`."""
        with contextlib.suppress(NavigationFailure):
            grown = view.with_grown_obstacles(PREFERRED_CLEARANCE_M)
            alternative = super()._plan_leg(grown, start, goal, tolerance, seed)
            if alternative.length() <= MAX_DETOUR_RATIO * path.length():
                return alternative
        return path

    def _make_followed_plan(self, path: Path) -> ClearancePlan:
        return ClearancePlan(path, self._radius, self._costmap.view)

    def _adopt(self, tick: int, now: float, result: PlanResult, reason: str) -> Event:
        event = super()._adopt(tick, now, result, reason)
        self._avoids_moving, self._moving_replanned_at = result.avoids_moving, now
        # With a latency, the costmap may have changed since planning, so the plan is checked at the next step.
        self._checked_revision = -1 if self._latency else self._costmap.revision
        self._max_obstacle_cells = self._costmap.obstacle_cell_count
        return event
