"""Drives to goals in order: Nav2's NavigateToPose tree (replanning and recovery) as a state machine.

Without errors one step is: check the goal, check the plan, ask the controller. When planning or control fails, first
the costmap is cleared and the same is tried again (the per-context recovery of Nav2's tree); when it fails again, the
next behaviour of the round robin is run. After `number_of_retries` behaviours the goal has failed with the code of
the last failure. A goal outside the map or inside a mapped wall fails after the first retry: no recovery changes that.
"""

from collections.abc import Callable
from dataclasses import replace

from simscen.core.events import Event, Value
from simscen.core.geometry import Pose2
from simscen.core.motion import STOP, Twist
from simscen.core.navigation import ErrorCode, Goal, Path
from simscen.model.stack import Planner as PlannerSpec
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.goal_checker import GoalChecker
from simscen.stack.progress_checker import ProgressChecker
from simscen.stack.protocols import Behavior, Controller, NavigationFailure, Planner
from simscen.stack.recovery import RoundRobin
from simscen.stack.replanning import PlanInForce

TIGHT_PERIOD = 0.5
"""Seconds between two looks for a roomier way where the followed one has become tight."""
MISSED_PERIOD = 1.0
"""Seconds that a car follows a plan before it may find that it has missed it."""
BETTER_PERIOD = 2.0
"""Seconds between two looks for a shorter way after obstacles have gone."""
RECONSIDER = 2
"""Every which step the plan is looked at: 10 Hz at the default rate, twice as often as Nav2's costmap is updated."""
GONE = 8
"""Cells of live obstacles that must have gone for that; single cells come and go with the lidar's noise."""
FAILURE_TOLERANCE = 0.3
"""nav2 controller_server: seconds a controller may fail before it counts."""


class Navigator:
    """One goal at a time; `step` is called at the controller's rate."""

    def __init__(
        self,
        spec: PlannerSpec,
        planner: Planner,
        controller: Controller,
        recovery: RoundRobin,
        goal_checker: GoalChecker,
        progress: ProgressChecker,
        costmap: Costmap,
        plan_seed: Callable[[int], int],
        period: float,
        radius: float,
        journal: list[Event],
        steered: bool = False,
    ) -> None:
        self._spec, self.planner, self._controller, self._recovery = spec, planner, controller, recovery
        self._goal_checker, self._progress, self._costmap = goal_checker, progress, costmap
        self._plan_seed, self._period, self._radius = plan_seed, period, radius
        self._events, self._steered = journal, steered
        self._plans = 0
        self._clock = 0.0
        self.goal: Goal | None = None
        self.plan: PlanInForce | None = None
        self._forget()

    def _forget(self) -> None:
        self.plan = None
        self._adopted = 0.0
        self._reason = "goal"
        self._behavior: Behavior | None = None
        self._behavior_since = 0.0
        self._retried = False
        self._trouble_since: float | None = None
        self._checked, self._looked, self._most = -1, self._clock, 0
        self._partial, self._origin = False, (0.0, 0.0)
        self._steps = 0

    def pursue(self, goal: Goal) -> None:
        """Drive to this goal from the next step on."""
        self.goal = goal
        self._forget()
        self._recovery.reset()
        self._goal_checker.reset()
        self._progress.reset()

    def stop(self) -> None:
        """Drop the goal."""
        self.goal = None
        self._forget()

    def step(self, tick: int, pose: Pose2, twist: Twist, held: bool = False) -> tuple[Twist, bool]:
        """The velocity wanted now, and whether the goal is reached. Raises NavigationFailure when it has failed.

        `held`: the collision monitor has kept the robot from driving for a while.
        """
        goal = self.goal
        if goal is None:
            return STOP, False
        self._clock += self._period
        if self._behavior is not None:
            return self._recover(tick, pose), False
        if self._goal_checker.reached(goal, pose, twist):
            return STOP, True
        try:
            command = self._follow(tick, goal, pose, twist, held)
        except NavigationFailure as failure:
            return self._failed(tick, goal, pose, failure), False
        self._trouble_since = None
        return command, False

    def _follow(self, tick: int, goal: Goal, pose: Pose2, twist: Twist, held: bool) -> Twist:
        if self.plan is None:
            self._adopt(tick, self._compute(tick, goal, pose), self._reason)
        assert self.plan is not None
        self._steps += 1
        if self._steps % RECONSIDER == 0:
            self.plan.locate(pose)
            self._reconsider(tick, goal, pose)
        command = self._controller.command(pose, twist, self._costmap.view, goal)
        if held:
            raise NavigationFailure(ErrorCode.FAILED_TO_MAKE_PROGRESS, "the collision monitor holds the robot")
        if self._progress.stuck(pose, self._clock):
            self._progress.reset()
            raise NavigationFailure(ErrorCode.FAILED_TO_MAKE_PROGRESS, "the robot does not get on")
        return command

    def _reconsider(self, tick: int, goal: Goal, pose: Pose2) -> None:
        """Replace the plan when it is blocked, outdated, or clearly longer than need be."""
        assert self.plan is not None
        if self._steered and self._clock - self._adopted >= MISSED_PERIOD and self.plan.missed(pose):
            self._adopt(tick, self._compute(tick, goal, pose), "missed")
            return
        if self._spec.replanning == "rate":
            if self._clock - self._looked >= 1.0 / self._spec.replanning_rate:
                self._adopt(tick, self._compute(tick, goal, pose), "rate")
            return
        costmap = self._costmap
        if costmap.view.revision != self._checked:
            self._checked = costmap.view.revision
            self._most = max(self._most, costmap.obstacle_cells)
            if self.plan.blocked(costmap.view):
                self._adopt(tick, self._compute(tick, goal, pose), "blocked")
                return
            if self._clock - self._adopted >= TIGHT_PERIOD and self.plan.tightened(costmap.view):
                self._adopt(tick, self._compute(tick, goal, pose), "tight")
                return
            if self._origin != costmap.view.origin and self._partial:
                self._adopt(tick, self._compute(tick, goal, pose), "window")
                return
        if self._clock - self._looked >= BETTER_PERIOD and self._something_went(costmap.obstacle_cells):
            other = self._compute(tick, goal, pose)
            if self.plan.worse_than(other):
                self._adopt(tick, other, "better")

    def _something_went(self, cells: int) -> bool:
        """Whether clearly fewer cells are marked than at some time since the last look: an obstacle has gone."""
        self._looked = self._clock
        gone = cells < self._most - GONE
        self._most = cells if gone else max(self._most, cells)
        return gone

    def _compute(self, tick: int, goal: Goal, pose: Pose2) -> Path:
        self._plans += 1
        aim = self._costmap.aim(pose, goal.pose)
        self._partial, self._origin = aim is not goal.pose, self._costmap.view.origin
        path = self.planner.plan(self._costmap.view, pose, aim, self._plan_seed(self._plans))
        x, y, yaw = path.points[-1].tolist()
        if not self._partial and goal.pose.distance(Pose2(x, y, yaw)) > goal.xy_tolerance:
            raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, "the robot does not fit within the goal's tolerance")
        return replace(path, tick=tick)

    def _adopt(self, tick: int, path: Path, reason: str) -> None:
        self.plan = PlanInForce(path, self._radius, self._costmap.view)
        self._adopted = self._clock
        self._controller.set_path(path)
        self._looked, self._checked = self._clock, self._costmap.view.revision
        self._note(tick, "plan.made", "", reason=reason, length=round(path.length(), 6))

    def _failed(self, tick: int, goal: Goal, pose: Pose2, failure: NavigationFailure) -> Twist:
        """Bear it a moment, clear and try again, recover, or give up: in this order."""
        planning = 200 <= failure.code < 300
        if not planning and failure.code != ErrorCode.FAILED_TO_MAKE_PROGRESS and self._tolerable():
            return STOP
        if planning:
            self._note(tick, "plan.failed", "", **_described(failure))
        if not self._retried:
            self._retried = True
            self._costmap.clear()
            self._reason, self.plan = "recovery", None
            return STOP
        if self._hopeless(goal, failure):
            raise failure
        self._retried, self.plan, self._reason, self._trouble_since = False, None, "recovery", None
        self._behavior = self._recovery.next()
        if self._behavior is None:
            raise failure
        self._behavior_since = self._clock
        self._note(tick, "recovery.started", self._behavior.name, **_described(failure))
        self._behavior.start(pose)
        return STOP

    def _tolerable(self) -> bool:
        if self._trouble_since is None:
            self._trouble_since = self._clock
        return self._clock - self._trouble_since < FAILURE_TOLERANCE

    def _hopeless(self, goal: Goal, failure: NavigationFailure) -> bool:
        if failure.code == ErrorCode.GOAL_OUTSIDE_MAP:
            return True
        return failure.code == ErrorCode.GOAL_OCCUPIED and not self._costmap.fits_static(goal.pose, goal.xy_tolerance)

    def _recover(self, tick: int, pose: Pose2) -> Twist:
        behavior = self._behavior
        assert behavior is not None
        try:
            command = behavior.step(pose, self._costmap.view, self._clock - self._behavior_since)
        except NavigationFailure as failure:
            self._note(tick, "recovery.ended", behavior.name, outcome="failed", **_described(failure))
            command = None
        else:
            if command is None:
                self._note(tick, "recovery.ended", behavior.name, outcome="succeeded")
        if command is None:
            self._behavior = None
            self._progress.reset()
            return STOP
        return command

    def _note(self, tick: int, kind: str, name: str, **data: Value) -> None:
        self._events.append(Event(tick, kind, name, data))


def _described(failure: NavigationFailure) -> dict[str, Value]:
    return {"error_code": int(failure.code), "error_name": failure.code.name, "message": str(failure)}
