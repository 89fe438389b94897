"""Planning part of Nav2's default behavior trees: requests, monitors, and replaces the plan that the robot follows."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.core.records.events import Event, EventKind, Value
from simscen.model.planners import PlannerSpec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.followed_plan import FollowedPlan
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner

MIN_MISSED_AGE_S = 1.0
"""Minimum age of a plan that a car can have missed (see FollowedPlan.is_missed)."""
CHECK_EVERY_STEPS = 2
"""Number of steps between two checks of the plan: 10 Hz at the default controller rate."""
TO_POSE_RATE_HZ, THROUGH_POSES_RATE_HZ = 1.0, 0.333
"""Replanning rates of Nav2's default trees, without and with intermediate goals."""
PLAN_END_M = 0.1
"""Remaining length of the plan below which the remaining intermediate goals count as missed."""


@dataclass(frozen=True)
class PlanResult:
    """A computed path.

    is_partial:     the path leads only to the edge of a rolling costmap
    origin:         corner (x, y) of the costmap on which the path was planned
    avoids_moving:  the costs included the predicted positions of moving obstacles
    """

    path: Path
    is_partial: bool
    origin: tuple[float, float]
    avoids_moving: bool = False


@dataclass(frozen=True)
class _Request:
    """A request to the planner.

    due:          tick at which the answer becomes available
    reason:       reason for the request, as in the event PLAN_MADE
    is_optional:  whether the current plan stays valid if planning fails
    answer:       the plan, or the failure
    """

    due: int
    reason: str
    is_optional: bool
    answer: PlanResult | NavigationFailure


class PlanManager:
    """Requests, monitors, and replaces the plan to the current goal. The parameter `now` is the navigator's time in s.

    Replans at a fixed rate, or only if the plan has become invalid. Subclasses may add reasons to replan.
    """

    def __init__(
        self,
        spec: PlannerSpec,
        planner: Planner,
        costmap: LayeredCostmap,
        plan_seed: Callable[[int], int],
        radius: float,
        is_car: bool = False,
        latency: int = 0,
        speed: float = 0.5,
    ) -> None:
        """Take the planner and the costmap to plan on.

        `plan_seed` returns the seed of the n-th plan. `radius` is the inscribed radius of the robot in m. A car cannot
        turn in place. `latency` is the planning time in ticks. `speed` is the robot's speed on a plan in m/s, which
        only subclasses use.
        """
        self._spec, self.planner, self._costmap = spec, planner, costmap
        self._plan_seed, self._radius, self._is_car, self._latency = plan_seed, radius, is_car, latency
        self._plan_count, self._speed = 0, speed
        self._via: tuple[Goal, ...] = ()
        self.reset(0.0)

    def reset(self, now: float) -> None:
        """Prepare for a new goal."""
        self.drop("goal")
        self._adopted_at = self._scheduled_at = now
        """Times at which the plan was adopted, and at which periodic replanning was last due."""
        self._is_partial, self._origin = False, (0.0, 0.0)
        self._steps = 0

    def drop(self, reason: str) -> None:
        """Discard the plan and any pending request. The next step requests a new plan with this reason."""
        self.plan: FollowedPlan | None = None
        self._request: _Request | None = None
        self._reason = reason

    def report_control_failure(self) -> None:
        """React to a control failure. Does nothing here; subclasses may override this method."""

    def step(self, tick: int, now: float, goal: Goal, pose: Pose2, via: tuple[Goal, ...] = ()) -> tuple[Event, ...]:
        """Request, receive, or replace the plan. Return an event if the robot now follows a new plan.

        The plan leads through the goals `via` to `goal` (Nav2's ComputePathThroughPoses). `plan` stays None while the
        first plan is being computed. Raises NavigationFailure when planning fails.
        """
        self._via = via
        if self.plan is None and self._request is None:
            self._send_request(tick, goal, pose, self._reason)
        events: tuple[Event, ...] = () if self._request is None else self._receive(tick, now)
        self._steps += 1
        if events or self.plan is None or self._steps % CHECK_EVERY_STEPS:
            return events
        self.plan.locate(pose)
        if self._request is None:
            if reason := self._mandatory_reason(now, pose, self.plan):
                self._send_request(tick, goal, pose, reason)
            elif reason := self._optional_reason(now, goal, pose, self.plan):
                self._send_request(tick, goal, pose, reason, is_optional=True)
        return events if self._request is None else self._receive(tick, now)

    @property
    def wait_ticks(self) -> int:
        """Latency of the planner in ticks while the robot waits for its first plan, otherwise 0."""
        return self._latency if self.plan is None and self._request is not None else 0

    def _send_request(self, tick: int, goal: Goal, pose: Pose2, reason: str, is_optional: bool = False) -> None:
        """Request a plan from the current pose. The answer becomes available after the planner's latency."""
        due = tick + self._latency
        try:
            answer: PlanResult | NavigationFailure = self._compute(due, goal, pose)
        except NavigationFailure as failure:
            answer = failure
        self._request = _Request(due, reason, is_optional, answer)

    def _receive(self, tick: int, now: float) -> tuple[Event, ...]:
        """Follow the requested plan if it is available. Raises the failure of a request that is not optional."""
        request = self._request
        if request is None or tick < request.due:
            return ()
        self._request = None
        if isinstance(request.answer, NavigationFailure):
            if request.is_optional:
                return ()
            raise request.answer
        if not self._accepts(request.reason, request.answer):
            return ()
        self._is_partial, self._origin = request.answer.is_partial, request.answer.origin
        return (self._adopt(tick, now, request.answer, request.reason),)

    def _mandatory_reason(self, now: float, pose: Pose2, plan: FollowedPlan) -> str:
        """Return the reason why the plan must be replaced; "" if it can still be followed."""
        if self._is_car and now - self._adopted_at >= MIN_MISSED_AGE_S and plan.is_missed(pose):
            return "missed"
        if self._via and not self._is_partial and plan.remaining() < PLAN_END_M:
            return "missed"
        return self._scheduled_reason(now, plan)

    def _scheduled_reason(self, now: float, plan: FollowedPlan) -> str:
        """Return "rate", "blocked", or "window" (the costmap has rolled) if it is time for a new plan, else ""."""
        rate = self._spec.replanning_rate or (THROUGH_POSES_RATE_HZ if self._via else TO_POSE_RATE_HZ)
        if now - self._scheduled_at < 1.0 / rate:
            return ""
        self._scheduled_at = now
        if self._spec.replanning == "on_invalid":
            if self._is_blocked(plan):
                return "blocked"
            return "window" if self._is_partial and self._costmap.view.origin != self._origin else ""
        is_near_goal = plan.remaining() < self._spec.proximity_threshold and not self._is_partial
        return "" if is_near_goal and not self._is_blocked(plan) else "rate"

    def _optional_reason(self, now: float, goal: Goal, pose: Pose2, plan: FollowedPlan) -> str:
        """Return the reason why a better plan may exist, or "". Always "" here; subclasses may override this method."""
        return ""

    def _is_blocked(self, plan: FollowedPlan) -> bool:
        """Return whether the plan is blocked on the current costmap."""
        plan.update_occupied_if_changed(self._costmap)
        return plan.is_blocked()

    def _accepts(self, reason: str, result: PlanResult) -> bool:
        """Return whether to follow a new plan. Always True here; subclasses may override this method."""
        return True

    def _compute(self, tick: int, goal: Goal, pose: Pose2) -> PlanResult:
        """Return one path through all intermediate goals to the goal. `tick` is the stamp of the path."""
        legs, start, is_partial = list[Array](), pose, False
        view = self._planning_view(pose)
        for target in (*self._via, goal):
            points, is_partial = self._compute_leg(view, target, start)
            legs.append(points)
            start = Pose2(*points[-1].tolist())
            if is_partial:
                break
        path = Path(np.concatenate([*(leg[:-1] for leg in legs[:-1]), legs[-1]]), tick)
        return PlanResult(path, is_partial, view.origin, view is not self._costmap.view)

    def _planning_view(self, pose: Pose2) -> CostmapView:
        """Return the costmap to plan on. Subclasses may add moving obstacles."""
        return self._costmap.view

    def _compute_leg(self, view: CostmapView, goal: Goal, start: Pose2) -> tuple[Array, bool]:
        """Return the poses (n, 3) from start to goal, and whether they lead only to the edge of the costmap."""
        self._plan_count += 1
        target = self._costmap.goal_in_window(start, goal.pose)
        is_partial = target is not goal.pose
        tolerance = math.inf if is_partial else goal.xy_tolerance
        return self._plan_leg(view, start, target, tolerance, self._plan_seed(self._plan_count)).points, is_partial

    def _plan_leg(self, view: CostmapView, start: Pose2, goal: Pose2, tolerance: float, seed: int) -> Path:
        """Return the planner's path. Raises NavigationFailure if it ends more than `tolerance` m from the goal."""
        path = self.planner.plan(view, start, goal, seed)
        if goal.distance(Pose2(*path.points[-1].tolist())) > tolerance:
            raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, "the robot does not fit within the goal's tolerance")
        return path

    def _make_followed_plan(self, path: Path) -> FollowedPlan:
        """Return the plan to follow. Subclasses may return a subclass of FollowedPlan."""
        return FollowedPlan(path, self._radius, self._costmap.view)

    def _adopt(self, tick: int, now: float, result: PlanResult, reason: str) -> Event:
        """Follow a new plan. Return the event PLAN_MADE."""
        self.plan = self._make_followed_plan(result.path)
        self._adopted_at = self._scheduled_at = now
        details: dict[str, Value] = {"reason": reason, "length": round(result.path.length(), 6)}
        return Event(tick, EventKind.PLAN_MADE, "", details)
