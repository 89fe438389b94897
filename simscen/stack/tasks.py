"""The list of goals: what is accepted, reached, passed, failed, canceled, and how the whole task ended."""

from simscen.core.clock import Clock
from simscen.core.messages.goal_names import Mode
from simscen.core.messages.navigation import ErrorCode, Goal, TaskResult
from simscen.core.records.events import Event, EventKind, Value

Events = tuple[Event, ...]


class Task:
    """Goals in order. Its methods return the events that a client of the action would see.

    Goals that are passed (`via`) and the one after them are one action: they fail, are canceled and preempted together.
    """

    def __init__(self, stop_on_failure: bool, *, clock: Clock | None = None, mode: Mode = "navigate_to_pose") -> None:
        """`clock` says how many ticks the goals' `wait` takes; default: as many as the default clock's."""
        self._stop_on_failure = stop_on_failure
        self._clock, self._mode = clock or Clock(), mode
        self._waiting: list[Goal] = []
        self._accepted = 0
        self._failure: ErrorCode | int | None = None
        self._stays: int | None = None
        self.goal: Goal | None = None
        """What is being driven to; None, too, while the robot waits where it is."""
        self.since = 0

    def start(self, goals: tuple[Goal, ...]) -> None:
        """A new task."""
        self._waiting, self.goal, self._failure, self._accepted = list(goals), None, None, 0
        self._stays = None

    def next(self, tick: int) -> Events:
        """Accept the next goal if none is being driven to; end the task when there is none left."""
        events = self.rest(tick)
        if self.goal is None and self._stays is None and self._waiting:
            self.goal, self.since = self._waiting.pop(0), tick
            pose = self.goal.pose
            at: dict[str, Value] = {"x": float(pose.x), "y": float(pose.y), "yaw": float(pose.yaw)}
            accepted = Event(tick, EventKind.GOAL_ACCEPTED, self.goal.name, {**at, "index": self._accepted})
            self._accepted += 1
            return (*events, accepted)
        return events

    @property
    def stays(self) -> bool:
        """Whether the robot is to stay where it is for a while."""
        return self._stays is not None

    def rest(self, tick: int) -> Events:
        """Time has come to this tick: a wait may be over; the task ends with its last one."""
        if self._stays is None or tick < self._stays:
            return ()
        self._stays = None
        return () if self._waiting else self._end(tick, TaskResult.SUCCEEDED)

    @property
    def ahead(self) -> tuple[Goal, ...]:
        """What follows the current goal in the same drive."""
        if self.goal is None or not self.goal.via:
            return ()
        last = next((k for k, goal in enumerate(self._waiting) if not goal.via), len(self._waiting) - 1)
        return tuple(self._waiting[: last + 1])

    def reached(self, tick: int) -> Events:
        """The goal is reached."""
        assert self.goal is not None
        reached = self._event(tick, EventKind.GOAL_REACHED)
        if self.goal.wait > 0:
            self._stays, self.goal = tick + self._clock.ticks(self.goal.wait), None
            return (reached,)
        return (reached, *self._close(tick, TaskResult.SUCCEEDED))

    def passed(self, tick: int) -> Events:
        """The goal, which is one to pass, is behind the robot."""
        return (self._event(tick, EventKind.GOAL_PASSED), *self._close(tick, TaskResult.SUCCEEDED))

    def failed(self, tick: int, code: ErrorCode | int, message: str) -> Events:
        """The goal has failed; so has the task when it stops on failures. A number is a code that has no name here."""
        said: dict[str, Value] = {"error_code": int(code), "error_name": _name(code), "message": message}
        dropped = self._drop(tick, EventKind.GOAL_FAILED, **said)
        self._failure = code
        if self._stop_on_failure:
            if self._mode == "follow_waypoints":
                self._failure = ErrorCode.STOP_ON_MISSED_WAYPOINT
            self._waiting = []
        return (*dropped, *self._close(tick, TaskResult.FAILED))

    def cancel(self, tick: int) -> Events:
        """Drop this goal and all after it."""
        if self.goal is None and self._stays is None:
            return ()
        dropped = () if self.goal is None else self._drop(tick, EventKind.GOAL_CANCELED)
        self._waiting, self._stays = [], None
        return (*dropped, *self._close(tick, TaskResult.CANCELED))

    def preempt(self, tick: int, goal: Goal) -> Events:
        """Drop this goal for another one; those after it follow. It ends a wait, too."""
        dropped = () if self.goal is None else self._drop(tick, EventKind.GOAL_CANCELED, preempted_by=goal.name)
        self.goal, self._stays = None, None
        self._waiting.insert(0, goal)
        return dropped

    def _drop(self, tick: int, kind: EventKind, **said: Value) -> Events:
        """The same becomes of the goal and of what follows it in the same drive."""
        ahead = self.ahead
        dropped = [self._event(tick, kind, **said)]
        for goal in ahead:
            dropped.append(Event(tick, kind, goal.name, {"index": self._accepted, **said}))
            self._accepted += 1
        self._waiting = self._waiting[len(ahead) :]
        return tuple(dropped)

    def _close(self, tick: int, result: TaskResult) -> Events:
        self.goal = None
        return () if self._waiting else self._end(tick, result)

    def _end(self, tick: int, result: TaskResult) -> Events:
        if self._failure is not None:
            result = TaskResult.FAILED
        code = self._failure or ErrorCode.NONE
        self._failure = None
        said: dict[str, Value] = {"error_code": int(code), "error_name": _name(code)}
        return (Event(tick, EventKind.NAVIGATION_ENDED, result.value, said),)

    @property
    def following(self) -> Goal | None:
        """The goal that is next."""
        return self._waiting[0] if self._waiting else None

    def _event(self, tick: int, kind: EventKind, **data: Value) -> Event:
        """Of the goal being driven to, which is the one accepted last."""
        assert self.goal is not None
        return Event(tick, kind, self.goal.name, {"index": self._accepted - 1, **data})


def _name(code: ErrorCode | int) -> str:
    return code.name if isinstance(code, ErrorCode) else ""
