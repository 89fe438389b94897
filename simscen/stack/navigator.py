"""Navigation to one goal: the replanning and recovery logic of Nav2's default behavior trees, as a state machine.

After a planning failure, the global costmap is cleared and planning is retried once. After a control failure, the local
costmap is cleared and control is retried once. If the retry fails, too, the next recovery behavior runs. Then planning
and control can each be retried again. After `number_of_retries` behaviors, the goal fails with the last error code.

There are two exceptions. After a planner error that is not in `planner_codes`, the goal fails at once. After
GOAL_OCCUPIED, the goal fails after the first retry if the robot does not fit on the map at the goal or at a via pose.
"""

from typing import NamedTuple

from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode
from simscen.core.records.events import Event, EventKind, Value
from simscen.stack.behaviors import BehaviorSequence
from simscen.stack.checkers import ProgressChecker
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.followed_plan import LocalPathSender
from simscen.stack.frames import Frames
from simscen.stack.plan_manager import PlanManager
from simscen.stack.protocols import Behavior, Controller, GoalChecker, NavigationFailure


class ClearingPolicy:
    """Decides how much of the global costmap is cleared after a planning failure.

    This class clears the entire costmap, as Nav2's default behavior tree does. Subclasses may clear less.
    """

    def reset(self) -> None:
        """Prepare for a new goal."""

    def clears_entirely(self, now: float, goal_distance: float) -> bool:
        """Return True to clear the entire global costmap, False to clear only the area around the robot.

        `now` is the navigator's time in s. `goal_distance` is the straight-line distance to the goal in m.
        """
        return True


class StepResult(NamedTuple):
    """Result of a step of the navigator.

    command:  velocity command; only used if the goal is neither reached nor failed
    reached:  whether the goal is reached
    failure:  the failure with which the goal has failed; None if it has not failed
    events:   events of this step
    """

    command: Twist = STOP
    reached: bool = False
    failure: NavigationFailure | None = None
    events: tuple[Event, ...] = ()


class Navigator:
    """Drives the robot to one goal at a time. Call `step` at the controller's rate.

    Goals and plans are in the map frame. Controller and recovery behaviors work in the odom frame.
    """

    def __init__(
        self,
        plans: PlanManager,
        controller: Controller,
        recovery: BehaviorSequence,
        goal_checker: GoalChecker,
        progress: ProgressChecker,
        costmaps: Costmaps,
        period: float,
        failure_tolerance: float,
        velocity_thresholds: Twist,
        clearing: ClearingPolicy,
    ) -> None:
        """Take the components, the `period` of the steps in s, and Nav2's `failure_tolerance` in s (-1: forever).

        Measured velocities up to `velocity_thresholds` count as 0.
        """
        self.plans = plans
        """The manager of the plan that is being followed."""
        self._controller, self._recovery = controller, recovery
        self._goal_checker, self._progress, self._costmaps = goal_checker, progress, costmaps
        self._local_path, self._clearing = LocalPathSender(controller), clearing
        self._period, self._failure_tolerance = period, failure_tolerance
        self._velocity_thresholds = velocity_thresholds
        self._now = 0.0
        """Time in s for which the navigator has had a goal."""
        self.goal: Goal | None = None
        """The current goal; None to stop."""
        self.via: tuple[Goal, ...] = ()
        """Intermediate goals to pass before the goal, in this order."""
        self._reset()

    def _reset(self) -> None:
        """Discard the plan, the active behavior, and the record of failures."""
        self.plans.reset(self._now)
        self._behavior: Behavior | None = None
        self._behavior_start = 0.0
        self._has_retried_planning = self._has_retried_control = False
        self._first_control_failure: float | None = None
        """Time in s of the first control failure since the last command or retry; None if there is none."""

    def pursue(self, goal: Goal) -> None:
        """Set the goal for the following steps, and restore all retries."""
        self.goal = goal
        self._reset()
        self._recovery.reset()
        self._clearing.reset()
        self._goal_checker.reset()
        self._progress.reset()

    def stop(self, tick: int) -> tuple[Event, ...]:
        """Remove the goal, so that `step` returns a stop. Return the event that ends the active behavior, if any."""
        behavior, self.goal, self.via = self._behavior, None, ()
        self._reset()
        return () if behavior is None else (_recovery_end_event(tick, behavior, {"outcome": "canceled"}),)

    def step(self, tick: int, frames: Frames, twist: Twist, is_held: bool = False, periods: int = 1) -> StepResult:
        """Run one step, `periods` controller periods after the previous step. `twist` is the measured velocity.

        `is_held`: the collision monitor has kept the robot stopped for `hold_timeout`, which is a control failure.
        """
        goal = self.goal
        if goal is None:
            return StepResult()
        self._now += periods * self._period
        if self._behavior is not None:
            return self._recover(tick, frames, self._behavior)
        if any(self._velocity_thresholds):
            twist = _apply_thresholds(twist, self._velocity_thresholds)
        if not self.via and self._goal_checker.reached(goal, frames.pose, twist):
            return StepResult(reached=True)
        events: tuple[Event, ...] = ()
        try:
            events = self.plans.step(tick, self._now, goal, frames.pose, self.via)
            command = self._follow(goal, frames, twist, is_held)
        except NavigationFailure as failure:
            result = self._handle_failure(tick, goal, frames, failure)
            return result._replace(events=(*events, *result.events))
        self._first_control_failure = None
        return StepResult(command, events=events)

    def _follow(self, goal: Goal, frames: Frames, twist: Twist, is_held: bool) -> Twist:
        """Return the controller's command on the current plan, or a stop if there is no plan yet."""
        plan = self.plans.plan
        if plan is None:
            return STOP
        self._has_retried_planning = False
        target = self.via[0] if self.via else goal  # the final goal may be close while intermediate goals remain
        local_target = self._local_path.update(plan, target, frames)
        command = self._controller.command(frames.odometry, twist, self._costmaps.local_costmap.view, local_target)
        if is_held:
            raise NavigationFailure(ErrorCode.FAILED_TO_MAKE_PROGRESS, "the collision monitor holds the robot")
        if self._progress.is_stuck(frames.pose, self._now):
            self._progress.reset()
            raise NavigationFailure(ErrorCode.FAILED_TO_MAKE_PROGRESS, "the robot made no progress")
        return command

    def _handle_failure(self, tick: int, goal: Goal, frames: Frames, failure: NavigationFailure) -> StepResult:
        """Tolerate the failure, clear a costmap and retry, start a recovery behavior, or let the goal fail."""
        is_planning_failure, events = 200 <= failure.code < 300, tuple[Event, ...]()
        if is_planning_failure:
            events = (Event(tick, EventKind.PLAN_FAILED, "", _failure_data(failure)),)
            if not self._recovery.can_help(failure):
                return StepResult(failure=failure, events=events)
            should_retry, self._has_retried_planning = not self._has_retried_planning, True
        else:
            if failure.code != ErrorCode.FAILED_TO_MAKE_PROGRESS:
                if self._is_tolerated():
                    return StepResult()
                failure = self._apply_patience(failure)
            self.plans.report_control_failure()
            should_retry, self._has_retried_control = not self._has_retried_control, True
        if should_retry:
            self._first_control_failure = None
            if is_planning_failure:
                goal_distance = frames.pose.distance(goal.pose)
                self._costmaps.clear_global(entirely=self._clearing.clears_entirely(self._now, goal_distance))
            else:
                self._costmaps.clear_local()
            self.plans.drop("recovery")
            return StepResult(events=events)
        if self._is_unreachable(goal, failure):
            return StepResult(failure=failure, events=events)
        self.plans.drop("recovery")
        self._has_retried_planning, self._has_retried_control, self._first_control_failure = False, False, None
        self._behavior = self._recovery.next_behavior(frames.pose.distance(goal.pose))
        if self._behavior is None:
            return StepResult(failure=failure, events=events)
        self._behavior_start = self._now
        self._behavior.start(frames.odometry)
        start_event = Event(tick, EventKind.RECOVERY_STARTED, self._behavior.name, _failure_data(failure))
        return StepResult(events=(*events, start_event))

    def _is_tolerated(self) -> bool:
        """Return whether control has failed for less than `failure_tolerance`."""
        if self._first_control_failure is None:
            self._first_control_failure = self._now
        tolerance = self._failure_tolerance
        return tolerance < 0.0 or self._now - self._first_control_failure < tolerance

    def _apply_patience(self, failure: NavigationFailure) -> NavigationFailure:
        """Return the failure; PATIENCE_EXCEEDED instead of NO_VALID_CONTROL if `failure_tolerance` is positive."""
        if self._failure_tolerance <= 0.0 or failure.code != ErrorCode.NO_VALID_CONTROL:
            return failure
        return NavigationFailure(ErrorCode.PATIENCE_EXCEEDED, f"for {self._failure_tolerance:g} s: {failure}")

    def _is_unreachable(self, goal: Goal, failure: NavigationFailure) -> bool:
        """Return whether the failure is caused by a goal at which the robot does not fit on the map."""
        return failure.code == ErrorCode.GOAL_OCCUPIED and not all(
            self._costmaps.global_costmap.fits_static(each.pose, each.xy_tolerance) for each in (*self.via, goal)
        )

    def _recover(self, tick: int, frames: Frames, behavior: Behavior) -> StepResult:
        """Run one step of the active recovery behavior."""
        result: dict[str, Value] = {"outcome": "succeeded"}
        try:
            costmap = self._costmaps.local_costmap.view
            command = behavior.step(frames.odometry, costmap, self._now - self._behavior_start)
        except NavigationFailure as failure:
            command, result = None, {"outcome": "failed", **_failure_data(failure)}
        if command is not None:
            return StepResult(command)
        self._behavior = None
        self._progress.reset()
        return StepResult(events=(_recovery_end_event(tick, behavior, result),))


def _apply_thresholds(velocity: Twist, thresholds: Twist) -> Twist:
    """Return the velocity; components up to their threshold become 0 (getThresholdedTwist of nav2_controller)."""
    return Twist(*(0.0 if abs(value) <= limit else value for value, limit in zip(velocity, thresholds, strict=True)))


def _recovery_end_event(tick: int, behavior: Behavior, result: dict[str, Value]) -> Event:
    """Return the event that ends a behavior."""
    return Event(tick, EventKind.RECOVERY_ENDED, behavior.name, result)


def _failure_data(failure: NavigationFailure) -> dict[str, Value]:
    """Return code, name, and message of the failure, as data of an event."""
    return {"error_code": int(failure.code), "error_name": failure.code.name, "message": str(failure)}
