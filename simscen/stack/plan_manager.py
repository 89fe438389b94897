"""Makes the plan, watches over it while it is followed, and replaces it when need be: half of Nav2's tree."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simscen.advanced.prediction.predicted_costs import add_predicted_costs, meets_moving_obstacle
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import ErrorCode, Goal, Path
from simscen.core.records.events import Event, EventKind, Value
from simscen.model.planners import PlannerSpec
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.followed_plan import FollowedPlan
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner

TIGHT_PERIOD = 0.5
"""Seconds between two looks for a roomier way where the followed one has become tight."""
MISSED_PERIOD = 1.0
"""Seconds that a car follows a plan before it may find that it has missed it."""
BETTER_PERIOD = 2.0
"""Seconds between two looks for a shorter way after obstacles have gone."""
MOVING_PERIOD = 0.5
"""Seconds between two plans around what moves."""
RECONSIDER = 2
"""Every which step the plan is looked at: 10 Hz at the default rate, twice as often as Nav2's costmap is updated."""
USUAL_RATE, THROUGH_POSES_RATE = 1.0, 0.333
"""Hz at which Nav2's default trees plan anew."""
NEARBY = 4.0
"""Metres of plan left within which Nav2's default trees (IsGoalNearby, ValidatePath) keep one that is not blocked."""
CAUTION = (0.10, 0.05)
"""Metres of room beyond what is needed that plans keep, if they can, once the robot could not follow one: where it is
as tight as belief, map and scan are uncertain, the same way would end the same again."""
ROOMIER, LITTLE_LONGER = 0.15, 1.15
"""Metres that they keep where that makes the way no longer than by this factor: a belief that is off by a cell, a
controller that cuts a bend and the collision monitor's margin add up to more than any of them."""
AT_ITS_END = 0.1
"""Metres from the end of a plan at which something that was to be passed has been missed."""
GONE = 8
"""Cells of live obstacles that must have gone for that; single cells come and go with the lidar's noise."""


class PlanManager:
    """Keeps the plan in force for one goal after another, in the map frame; `now` is the navigator's clock."""

    def __init__(
        self,
        spec: PlannerSpec,
        planner: Planner,
        costmap: Costmap,
        plan_seed: Callable[[int], int],
        radius: float,
        steered: bool = False,
        latency: int = 0,
        speed: float = 0.5,
    ) -> None:
        """`latency`: ticks from the question to the plan; `speed`: m/s at which it will be driven."""
        self._spec, self.planner, self._costmap = spec, planner, costmap
        self._plan_seed, self._radius, self._steered, self._latency = plan_seed, radius, steered, latency
        self._speed = speed
        self._plans = 0
        self._via: tuple[Goal, ...] = ()
        self.reset(0.0)

    def reset(self, now: float) -> None:
        """A new goal."""
        self.drop("goal")
        self._checked, self._adopted, self._looked, self._most = -1, now, now, 0
        self._bent, self._minded = False, now
        self._partial, self._origin = False, (0.0, 0.0)
        self._steps, self._cautious = 0, False

    def drop(self, reason: str) -> None:
        """Make a new plan at the next step, for this reason; what is being worked out is of no use any more."""
        self.plan: FollowedPlan | None = None
        self._asked: _Asked | None = None
        self._reason = reason

    def not_followed(self) -> None:
        """The plan could not be followed: until the next goal, take a roomier way where there is one."""
        self._cautious = self._spec.cautious

    def step(self, tick: int, now: float, goal: Goal, pose: Pose2, via: tuple[Goal, ...] = ()) -> tuple[Event, ...]:
        """See to it that there is a plan that can be followed; there is none while the first one is being worked out.

        One plan leads past all poses of `via` (Nav2's ComputePathThroughPoses). Returns that a plan was made, if it
        was. Raises NavigationFailure when there is none.
        """
        self._via = via
        if self.plan is None and self._asked is None:
            self._ask(tick, goal, pose, self._reason)
        made: tuple[Event, ...] = () if self._asked is None else self._hear(tick, now)
        self._steps += 1
        if made or self.plan is None or self._steps % RECONSIDER:
            return made
        self.plan.locate(pose)
        if self._asked is None:
            self._reconsider(tick, now, goal, pose, self.plan)
        return made if self._asked is None else self._hear(tick, now)

    @property
    def waiting(self) -> int:
        """How many ticks the planner takes, where there is no plan to follow meanwhile; else 0."""
        return self._latency if self.plan is None and self._asked is not None else 0

    @property
    def _rate(self) -> float:
        return self._spec.replanning_rate or (THROUGH_POSES_RATE if self._via else USUAL_RATE)

    def _reconsider(self, tick: int, now: float, goal: Goal, pose: Pose2, plan: FollowedPlan) -> None:
        """Ask for another plan when this one is blocked, outdated, or may be clearly longer than need be."""
        reason = self._must_replan(now, pose, plan)
        if reason:
            self._ask(tick, goal, pose, reason)
        elif wish := self._moved(now, pose, plan) or self._may_replan(now, goal, pose, plan):
            self._ask(tick, goal, pose, wish, wished=True)

    def _ask(self, tick: int, goal: Goal, pose: Pose2, reason: str, wished: bool = False) -> None:
        """Plan from here and now; the answer is there when the planner would be done."""
        due, before = tick + self._latency, (self._partial, self._origin, self._bent)
        try:
            answer: Path | NavigationFailure = self._compute(due, goal, pose)
        except NavigationFailure as failure:
            answer = failure
        self._asked = _Asked(due, reason, wished, answer, self._partial, self._origin, self._bent)
        self._partial, self._origin, self._bent = before

    def _hear(self, tick: int, now: float) -> tuple[Event, ...]:
        """Follow the plan that was asked for, once it is there. Raises what it failed with."""
        asked = self._asked
        if asked is None or tick < asked.due:
            return ()
        self._asked = None
        if isinstance(asked.answer, NavigationFailure):
            if asked.wished:
                return ()  # it was only a look: the plan that is being followed is still good
            raise asked.answer
        if asked.reason == "better" and (self.plan is None or not self.plan.worse_than(asked.answer.length())):
            return ()
        self._partial, self._origin, self._bent = asked.partial, asked.origin, asked.bent
        return (self._adopt(tick, now, asked.answer, asked.reason),)

    def _must_replan(self, now: float, pose: Pose2, plan: FollowedPlan) -> str:
        """Why the plan cannot be followed any more; "" if it can."""
        if self._steered and now - self._adopted >= MISSED_PERIOD and plan.missed(pose):
            return "missed"
        if self._via and not self._partial and plan.remaining() < AT_ITS_END:
            return "missed"
        if self._spec.replanning == "rate":
            if now - self._looked < 1.0 / self._rate:
                return ""
            self._looked = now
            near = plan.remaining() < NEARBY and not self._partial
            return "" if near and not self._blocked(plan) else "rate"
        if self._costmap.revision == self._checked:
            return ""
        if self._blocked(plan):
            return "blocked"
        return "window" if self._partial and self._costmap.view.origin != self._origin else ""

    def _blocked(self, plan: FollowedPlan) -> bool:
        plan.watch(self._costmap)
        return plan.blocked()

    def _moved(self, now: float, pose: Pose2, plan: FollowedPlan) -> str:
        """Why what moves calls for another plan: this one meets it, or leads around where it was to be met."""
        moving = self._costmap.moving
        if not (self._bent or len(moving)) or now - self._minded < MOVING_PERIOD or self._spec.replanning == "rate":
            return ""
        if not self._bent and not meets_moving_obstacle(moving, pose, plan.places(4), self._speed, self._radius):
            return ""
        self._minded = now
        return "moving"

    def _may_replan(self, now: float, goal: Goal, pose: Pose2, plan: FollowedPlan) -> str:
        """Why there may be a better plan by now; "" if nothing speaks for it."""
        if self._spec.replanning == "rate":
            return ""
        if self._costmap.revision != self._checked:
            self._checked = self._costmap.revision
            self._most = max(self._most, self._costmap.obstacle_cells)
            if now - self._adopted >= TIGHT_PERIOD and plan.tightened():
                return "tight"
        if now - self._looked < BETTER_PERIOD:
            return ""
        self._looked, cells = now, self._costmap.obstacle_cells
        gone = cells < self._most - GONE
        self._most = cells if gone else max(self._most, cells)
        return "better" if gone and self._can_be_shorter(goal, pose, plan) else ""

    def _can_be_shorter(self, goal: Goal, pose: Pose2, plan: FollowedPlan) -> bool:
        """Whether a plan straight to where the goal may be reached would be taken: no other is shorter."""
        return self._partial or plan.worse_than(pose.distance(goal.pose) - goal.xy_tolerance)

    def _compute(self, tick: int, goal: Goal, pose: Pose2) -> Path:
        """One path through all that is to be passed; where it turns from one to the next, it heads for the next."""
        legs, start = list[Array](), pose
        seen = self._costmap.view
        view = add_predicted_costs(seen, pose, self._speed, self._radius)
        self._bent = view is not seen
        for stop in (*self._via, goal):
            points = self._leg(view, stop, start)
            legs.append(points)
            start = Pose2(*points[-1].tolist())
            if self._partial:
                break
        return Path(np.concatenate([*(leg[:-1] for leg in legs[:-1]), legs[-1]]), tick)

    def _leg(self, view: CostmapView, goal: Goal, start: Pose2) -> Array:
        self._plans += 1
        aim = self._costmap.aim(start, goal.pose)
        self._partial, self._origin = aim is not goal.pose, view.origin
        path = self._planned(view, start, aim, self._plan_seed(self._plans))
        x, y, yaw = path.points[-1].tolist()
        if not self._partial and goal.pose.distance(Pose2(x, y, yaw)) > goal.xy_tolerance:
            raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, "the robot does not fit within the goal's tolerance")
        return path.points

    def _planned(self, view: CostmapView, pose: Pose2, aim: Pose2, seed: int) -> Path:
        for room in CAUTION if self._cautious else ():
            with contextlib.suppress(NavigationFailure):  # no roomier way
                path = self.planner.plan(view.with_less_room(room), pose, aim, seed)
                return self._roomier(path, view, pose, aim, seed)
        return self.planner.plan(view, pose, aim, seed)

    def _roomier(self, path: Path, view: CostmapView, pose: Pose2, aim: Pose2, seed: int) -> Path:
        """One that is hardly longer and keeps more room, if there is one."""
        with contextlib.suppress(NavigationFailure):
            other = self.planner.plan(view.with_less_room(ROOMIER), pose, aim, seed)
            if other.length() <= LITTLE_LONGER * path.length():
                return other
        return path

    def _adopt(self, tick: int, now: float, path: Path, reason: str) -> Event:
        view = self._costmap.view
        self.plan = FollowedPlan(path, self._radius, view)
        self._adopted = self._looked = self._minded = now
        self._checked, self._most = view.revision, self._costmap.obstacle_cells
        made: dict[str, Value] = {"reason": reason, "length": round(path.length(), 6)}
        return Event(tick, EventKind.PLAN_MADE, "", made)


@dataclass(frozen=True)
class _Asked:
    """A question to the planner, and what it will have found at the tick `due`; `wished`: it may as well not be."""

    due: int
    reason: str
    wished: bool
    answer: Path | NavigationFailure
    partial: bool
    origin: tuple[float, float]
    bent: bool
