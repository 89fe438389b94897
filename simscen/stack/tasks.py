"""The list of goals: what is accepted, reached, failed, canceled, and how the whole task ended."""

from simscen.core.events import Event, EventKind, Value
from simscen.core.navigation import ErrorCode, Goal, TaskResult


class Task:
    """Goals in order, and the events that a client of the action would see."""

    def __init__(self, stop_on_failure: bool, journal: list[Event]) -> None:
        self._stop_on_failure, self._events = stop_on_failure, journal
        self._waiting: list[Goal] = []
        self._accepted = 0
        self._failure: ErrorCode | int | None = None
        self.goal: Goal | None = None
        self.since = 0

    def start(self, goals: tuple[Goal, ...]) -> None:
        """A new task."""
        self._waiting, self.goal, self._failure, self._accepted = list(goals), None, None, 0

    def next(self, tick: int) -> Goal | None:
        """Accept the next goal if none is being driven to; end the task when there is none left."""
        if self.goal is None and self._waiting:
            self.goal, self.since = self._waiting.pop(0), tick
            pose = self.goal.pose
            self._note(tick, EventKind.GOAL_ACCEPTED, x=float(pose.x), y=float(pose.y), yaw=float(pose.yaw))
            self._accepted += 1
        return self.goal

    def reached(self, tick: int) -> None:
        """The goal is reached."""
        self._note(tick, EventKind.GOAL_REACHED, index=self._accepted - 1)
        self._close(tick, TaskResult.SUCCEEDED)

    def failed(self, tick: int, code: ErrorCode | int, message: str) -> None:
        """The goal has failed; so has the task when it stops on failures. A number is a code that has no name here."""
        said: dict[str, Value] = {"error_code": int(code), "error_name": _name(code), "message": message}
        self._note(tick, EventKind.GOAL_FAILED, index=self._accepted - 1, **said)
        self._failure = code
        if self._stop_on_failure:
            self._waiting = []
        self._close(tick, TaskResult.FAILED)

    def cancel(self, tick: int) -> None:
        """Drop this goal and all after it."""
        if self.goal is None:
            return
        self._note(tick, EventKind.GOAL_CANCELED, index=self._accepted - 1)
        self._waiting = []
        self._close(tick, TaskResult.CANCELED)

    def preempt(self, tick: int, goal: Goal) -> None:
        """Drop this goal for another one; those after it follow."""
        if self.goal is not None:
            self._note(tick, EventKind.GOAL_CANCELED, index=self._accepted - 1, preempted_by=goal.name)
        self.goal = None
        self._waiting.insert(0, goal)

    def _close(self, tick: int, result: TaskResult) -> None:
        self.goal = None
        if self._waiting:
            return
        if self._failure is not None:
            result = TaskResult.FAILED
        code = self._failure or ErrorCode.NONE
        self._events.append(
            Event(tick, EventKind.NAVIGATION_ENDED, result.value, {"error_code": int(code), "error_name": _name(code)})
        )
        self._failure = None

    @property
    def following(self) -> Goal | None:
        """The goal that is next."""
        return self._waiting[0] if self._waiting else None

    def _note(self, tick: int, kind: EventKind, **data: Value) -> None:
        assert self.goal is not None
        data.setdefault("index", self._accepted)
        self._events.append(Event(tick, kind, self.goal.name, data))


def _name(code: ErrorCode | int) -> str:
    return code.name if isinstance(code, ErrorCode) else ""
