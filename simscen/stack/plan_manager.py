"""Planning half of Nav2's default behavior trees: request a plan, monitor it while it is followed, and replace it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Goal, Path
from simscen.core.records.events import Event, EventKind, Value
from simscen.model.planners import PlannerSpec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.followed_plan import FollowedPlan
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner

MISSED_AFTER_S = 1.0
"""A car follows a plan for this time before it may find that it has missed it."""
CHECK_EVERY_STEPS = 2
"""Steps between two checks of the plan: 10 Hz at the default controller rate."""
TO_POSE_RATE_HZ, THROUGH_POSES_RATE_HZ = 1.0, 0.333
"""Replanning rates of Nav2's default trees."""
PLAN_END_M = 0.1
"""An intermediate goal that is not reached this close to the end of the plan has been missed."""


@dataclass(frozen=True)
class PlanResult:
    """A computed path. `is_partial`: it leads only to the edge of a rolling costmap, whose corner was at `origin`.

    `avoids_moving`: it was planned on costs that include predicted obstacles.
    """

    path: Path
    is_partial: bool
    origin: tuple[float, float]
    avoids_moving: bool = False


@dataclass(frozen=True)
class _Request:
    """A request to the planner that is answered at the tick `due`; if `is_optional`, a failure has no consequence."""

    due: int
    reason: str
    is_optional: bool
    answer: PlanResult | NavigationFailure


class PlanManager:
    """Maintains the plan in the map frame for one goal after another. Times `now` are those of the navigator's clock.

    Replans as Nav2's trees do: at a fixed rate, or only if the plan has become invalid. Subclasses may add reasons.
    """

    def __init__(
        self,
        spec: PlannerSpec,
        planner: Planner,
        costmap: LayeredCostmap,
        plan_seed: Callable[[int], int],
        radius: float,
        steered: bool = False,
        latency: int = 0,
    ) -> None:
        """Take the planner and its costmap.

        `plan_seed` returns the seed of the n-th plan, `radius` is the inscribed radius of the robot in m, `steered`
        means that it cannot turn in place, and `latency` is the time that planning takes, in ticks.
        """
        self._spec, self.planner, self._costmap = spec, planner, costmap
        self._plan_seed, self._radius, self._steered, self._latency = plan_seed, radius, steered, latency
        self._plan_count = 0
        self._via: tuple[Goal, ...] = ()
        self.reset(0.0)

    def reset(self, now: float) -> None:
        """Prepare for a new goal."""
        self.drop("goal")
        self._adopted_at = self._scheduled_at = now
        self._is_partial, self._origin = False, (0.0, 0.0)
        self._steps = 0

    def drop(self, reason: str) -> None:
        """Discard the plan and any pending request; the next step requests a new plan for this reason."""
        self.plan: FollowedPlan | None = None
        self._request: _Request | None = None
        self._reason = reason

    def report_control_failure(self) -> None:
        """Handle that the controller could not follow the plan. Has no effect here."""

    def step(self, tick: int, now: float, goal: Goal, pose: Pose2, via: tuple[Goal, ...] = ()) -> tuple[Event, ...]:
        """Request, receive, or replace the plan, and return an event if a new plan is followed.

        One plan leads through all poses of `via` (Nav2's ComputePathThroughPoses). `plan` is None while the first plan
        is being computed. Raises NavigationFailure when planning fails.
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
    def waiting(self) -> int:
        """The latency of the planner in ticks while there is no plan to follow, otherwise 0."""
        return self._latency if self.plan is None and self._request is not None else 0

    def _send_request(self, tick: int, goal: Goal, pose: Pose2, reason: str, is_optional: bool = False) -> None:
        """Plan from the current pose; the answer becomes available after the planner's latency."""
        due = tick + self._latency
        try:
            answer: PlanResult | NavigationFailure = self._compute(due, goal, pose)
        except NavigationFailure as failure:
            answer = failure
        self._request = _Request(due, reason, is_optional, answer)

    def _receive(self, tick: int, now: float) -> tuple[Event, ...]:
        """Follow the requested plan once it is available. Raises the failure of a mandatory request."""
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
        """Return why the plan must be replaced; "" if it can still be followed."""
        if self._steered and now - self._adopted_at >= MISSED_AFTER_S and plan.missed(pose):
            return "missed"
        if self._via and not self._is_partial and plan.remaining() < PLAN_END_M:
            return "missed"
        return self._scheduled_reason(now, plan)

    def _scheduled_reason(self, now: float, plan: FollowedPlan) -> str:
        """Return why a new plan is due by the clock: "rate", or with `replanning: on_invalid` "blocked" or "window"."""
        rate = self._spec.replanning_rate or (THROUGH_POSES_RATE_HZ if self._via else TO_POSE_RATE_HZ)
        if now - self._scheduled_at < 1.0 / rate:
            return ""
        self._scheduled_at = now
        if self._spec.replanning == "on_invalid":
            if self._is_blocked(plan):
                return "blocked"
            return "window" if self._is_partial and self._costmap.view.origin != self._origin else ""
        may_keep = plan.remaining() < self._spec.proximity_threshold and not self._is_partial
        return "" if may_keep and not self._is_blocked(plan) else "rate"

    def _optional_reason(self, now: float, goal: Goal, pose: Pose2, plan: FollowedPlan) -> str:
        """Return why there may be a better plan; "" if there is no reason."""
        return ""

    def _is_blocked(self, plan: FollowedPlan) -> bool:
        plan.compare_if_changed(self._costmap)
        return plan.blocked()

    def _accepts(self, reason: str, result: PlanResult) -> bool:
        """Return whether to follow a new plan."""
        return True

    def _compute(self, tick: int, goal: Goal, pose: Pose2) -> PlanResult:
        """Compute one path through all intermediate goals; each leg ends with the heading to the next one."""
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
        """Return the costmap to plan on."""
        return self._costmap.view

    def _compute_leg(self, view: CostmapView, goal: Goal, start: Pose2) -> tuple[Array, bool]:
        """Return the points (n, 3) to a goal, and whether they lead only to the edge of the costmap."""
        self._plan_count += 1
        aim = self._costmap.aim(start, goal.pose)
        is_partial = aim is not goal.pose
        path = self._call_planner(view, start, aim, self._plan_seed(self._plan_count))
        x, y, yaw = path.points[-1].tolist()
        if not is_partial and goal.pose.distance(Pose2(x, y, yaw)) > goal.xy_tolerance:
            raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, "the robot does not fit within the goal's tolerance")
        return path.points, is_partial

    def _call_planner(self, view: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        return self.planner.plan(view, start, goal, seed)

    def _followed(self, path: Path) -> FollowedPlan:
        return FollowedPlan(path, self._radius, self._costmap.view)

    def _adopt(self, tick: int, now: float, result: PlanResult, reason: str) -> Event:
        """Follow a new plan, and return the event."""
        self.plan = self._followed(result.path)
        self._adopted_at = self._scheduled_at = now
        details: dict[str, Value] = {"reason": reason, "length": round(result.path.length(), 6)}
        return Event(tick, EventKind.PLAN_MADE, "", details)
