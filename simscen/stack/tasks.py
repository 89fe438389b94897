"""Goals of a navigation task and their progress, with the events that the client of a Nav2 action would see."""

from simscen.core.clock import Clock
from simscen.core.messages.goals import Goal, Mode
from simscen.core.messages.navigation import ErrorCode, TaskResult
from simscen.core.records.events import Event, EventKind, Value

Events = tuple[Event, ...]


class Task:
    """Goals in the order in which the robot drives to them. Methods that change the task return the resulting events.

    Intermediate goals (`via`) and the goal after them form one action. All goals of an action fail, or are canceled,
    together.
    """

    def __init__(self, stop_on_failure: bool, *, clock: Clock | None = None, mode: Mode = "navigate_to_pose") -> None:
        """Create an empty task.

        If `stop_on_failure` is true, a failed goal ends the task. `clock` converts the `wait` times of goals to ticks.
        `mode` is the Nav2 action that the task imitates, which determines the error code of a failed task.
        """
        self._stop_on_failure = stop_on_failure
        self._clock, self._mode = clock or Clock(), mode
        self._waiting: list[Goal] = []
        """Goals that have not been accepted yet."""
        self._accepted = 0
        """Number of accepted goals."""
        self._failure: ErrorCode | int | None = None
        """Error code of the task; None if no goal has failed."""
        self._wait_until: int | None = None
        """Tick at which the wait at a goal ends; None without a wait."""
        self.goal: Goal | None = None
        """The current goal; None also while the robot waits at a goal."""
        self.since = 0
        """Tick at which the current goal was accepted."""

    def start(self, goals: tuple[Goal, ...]) -> None:
        """Start a task with these goals."""
        self._waiting, self.goal, self._failure, self._accepted = list(goals), None, None, 0
        self._wait_until = None

    def accept_next(self, tick: int) -> Events:
        """End the wait at a goal if its time is over. Accept the next goal if there is no current goal and no wait."""
        events = self.end_wait(tick)
        if self.goal is None and self._wait_until is None and self._waiting:
            self.goal, self.since = self._waiting.pop(0), tick
            pose = self.goal.pose
            position: dict[str, Value] = {"x": float(pose.x), "y": float(pose.y), "yaw": float(pose.yaw)}
            accepted = Event(tick, EventKind.GOAL_ACCEPTED, self.goal.name, {**position, "index": self._accepted})
            self._accepted += 1
            return (*events, accepted)
        return events

    @property
    def is_waiting(self) -> bool:
        """Whether the robot waits at a goal that it has reached."""
        return self._wait_until is not None

    def end_wait(self, tick: int) -> Events:
        """End the wait at a goal if its time is over. Then end the task if no goal is left."""
        if self._wait_until is None or tick < self._wait_until:
            return ()
        self._wait_until = None
        return () if self._waiting else self._end_task(tick, TaskResult.SUCCEEDED)

    @property
    def remaining_in_action(self) -> tuple[Goal, ...]:
        """The goals after the current one in the same action."""
        if self.goal is None or not self.goal.via:
            return ()
        last = next((k for k, goal in enumerate(self._waiting) if not goal.via), len(self._waiting) - 1)
        return tuple(self._waiting[: last + 1])

    def record_reached(self, tick: int) -> Events:
        """Record that the current goal is reached. Start the wait at this goal, if it has one."""
        assert self.goal is not None
        reached = self._event(tick, EventKind.GOAL_REACHED)
        if self.goal.wait > 0:
            self._wait_until, self.goal = tick + self._clock.ticks(self.goal.wait), None
            return (reached,)
        return (reached, *self._end_goal(tick, TaskResult.SUCCEEDED))

    def record_passed(self, tick: int) -> Events:
        """Record that the robot has passed the current goal, which is an intermediate goal."""
        return (self._event(tick, EventKind.GOAL_PASSED), *self._end_goal(tick, TaskResult.SUCCEEDED))

    def record_failed(self, tick: int, code: ErrorCode | int, message: str) -> Events:
        """Record that the current goal has failed. End the task if `stop_on_failure` is true.

        `code` is an int if a stack of another package uses an error code that ErrorCode does not contain.
        """
        details: dict[str, Value] = {"error_code": int(code), "error_name": _error_name(code), "message": message}
        dropped = self._end_action(tick, EventKind.GOAL_FAILED, **details)
        self._failure = code
        if self._stop_on_failure:
            if self._mode == "follow_waypoints":
                self._failure = ErrorCode.STOP_ON_MISSED_WAYPOINT
            self._waiting = []
        return (*dropped, *self._end_goal(tick, TaskResult.FAILED))

    def cancel(self, tick: int) -> Events:
        """Cancel the current goal or wait, and all later goals. Do nothing if there is nothing to cancel.

        The task ends as canceled even if an earlier goal has failed.
        """
        if self.goal is None and self._wait_until is None and not self._waiting:
            return ()
        dropped = () if self.goal is None else self._end_action(tick, EventKind.GOAL_CANCELED)
        self._waiting, self._wait_until, self._failure = [], None, None
        return (*dropped, *self._end_goal(tick, TaskResult.CANCELED))

    def preempt(self, tick: int, goal: Goal) -> Events:
        """Cancel the current action (or wait), and insert `goal` before the goals of later actions."""
        dropped = () if self.goal is None else self._end_action(tick, EventKind.GOAL_CANCELED, preempted_by=goal.name)
        self.goal, self._wait_until = None, None
        self._waiting.insert(0, goal)
        return dropped

    def _end_action(self, tick: int, kind: EventKind, **details: Value) -> Events:
        """End the current goal and the other goals of its action, each with an event of this kind."""
        remaining = self.remaining_in_action
        dropped = [self._event(tick, kind, **details)]
        for goal in remaining:
            dropped.append(Event(tick, kind, goal.name, {"index": self._accepted, **details}))
            self._accepted += 1
        self._waiting = self._waiting[len(remaining) :]
        return tuple(dropped)

    def _end_goal(self, tick: int, result: TaskResult) -> Events:
        """End the current goal. If no goal is left, end the task with this result."""
        self.goal = None
        return () if self._waiting else self._end_task(tick, result)

    def _end_task(self, tick: int, result: TaskResult) -> Events:
        """End the task with this result; with the result FAILED if a goal has failed."""
        if self._failure is not None:
            result = TaskResult.FAILED
        code = self._failure or ErrorCode.NONE
        self._failure = None
        details: dict[str, Value] = {"error_code": int(code), "error_name": _error_name(code)}
        return (Event(tick, EventKind.NAVIGATION_ENDED, result.value, details),)

    @property
    def upcoming_goal(self) -> Goal | None:
        """The goal that will be accepted next; None if no goal is left."""
        return self._waiting[0] if self._waiting else None

    def _event(self, tick: int, kind: EventKind, **data: Value) -> Event:
        """Return an event of the current goal, which is the goal that was accepted last."""
        assert self.goal is not None
        return Event(tick, kind, self.goal.name, {"index": self._accepted - 1, **data})


def _error_name(code: ErrorCode | int) -> str:
    return code.name if isinstance(code, ErrorCode) else ""
