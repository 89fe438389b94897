"""Track the goals of an external stack from the events that it reports.

The stack reports only the outcome of a goal. The tracker knows which goal is current, and derives preemption and the
end of the task, so that the events of a log are always consistent.
"""

from typing import Any

from simscen.core.clock import Clock
from simscen.core.messages.navigation import ErrorCode, Goal, Mode, error_code
from simscen.core.records.events import Event, EventKind, Value
from simscen.run.external.protocol import ProtocolViolation
from simscen.stack.tasks import Task

MAX_ERROR_CODE = 65_535
MAX_TEXT_LENGTH = 4096
_FREE = {kind.value for kind in EventKind if kind.value.split(".")[0] in ("plan", "recovery")} | {
    EventKind.ROBOT_HELD.value,
    EventKind.ROBOT_RELEASED.value,
}
"""Kinds of events that a stack may report at any time."""


class GoalTracker:
    """The goals of a run and their state as reported by the stack."""

    def __init__(self, stop_on_failure: bool, tick_rate: int, mode: Mode = "navigate_to_pose") -> None:
        self._events: list[Event] = []
        self._task = Task(stop_on_failure, clock=Clock(tick_rate), mode=mode)
        self._rate = tick_rate
        self._dropped: set[str] = set()

    def start(self, goals: tuple[Goal, ...]) -> None:
        """Start a new task."""
        self._task.start(goals)

    @property
    def goal(self) -> Goal | None:
        """The current goal."""
        return self._task.goal

    def preempt(self, tick: int, goal: Goal) -> None:
        """Replace the current goal by another one."""
        self._drop()
        self._events += self._task.preempt(tick, goal)

    def hear(self, tick: int, said: dict[str, Any]) -> None:
        """Process an event that the stack reports. Raises ProtocolViolation."""
        kind, name, data = said.get("kind"), said.get("name", ""), said.get("data", {})
        if not isinstance(kind, str) or not isinstance(name, str) or not isinstance(data, dict):
            raise ProtocolViolation(f"an event that is none: {str(said)[:100]}")
        if said.get("tick", tick) != tick:
            raise ProtocolViolation(f"an event of tick {said['tick']} at tick {tick}")
        match kind:
            case "goal.accepted":
                self._accept(tick, name)
            case "goal.reached":
                self._current(kind, name)
                self._events += self._task.reached(tick)
            case "goal.passed":
                self._current(kind, name)
                if self._task.goal is not None and not self._task.goal.via:
                    raise ProtocolViolation(f"goal.passed `{name[:60]}`, which is a goal to stop at")
                self._events += self._task.passed(tick)
            case "goal.failed":
                self._current(kind, name)
                code, message = _code(data.get("error_code")), str(data.get("message", ""))[:MAX_TEXT_LENGTH]
                self._events += self._task.failed(tick, code, message)
            case "goal.canceled":
                self._cancel(tick, name)
            case _ if kind in _FREE:
                self._events.append(Event(tick, EventKind(kind), name[:MAX_TEXT_LENGTH], _plain(data)))
            case _:
                raise ProtocolViolation(f"an event `{kind[:60]}`, which is not a stack's to tell")

    def rest(self, tick: int) -> None:
        """Advance to a tick, which can end a wait at a goal and the task."""
        self._events += self._task.end_wait(tick)

    def overdue(self, tick: int) -> bool:
        """Fail the current goal if its timeout is over; return whether it was."""
        goal = self._task.goal
        if goal is None or goal.timeout is None or tick - self._task.since <= goal.timeout * self._rate:
            return False
        self._drop()
        self._events += self._task.failed(tick, ErrorCode.NAVIGATE_TIMEOUT, f"{goal.timeout:g} s are over")
        return True

    def take(self) -> tuple[Event, ...]:
        """Return the events since the last call."""
        events, self._events = tuple(self._events), []
        return events

    def _drop(self) -> None:
        """Ignore the `goal.canceled` that the stack will report for the current goal."""
        if self._task.goal is not None:
            self._dropped.add(self._task.goal.name)

    def _accept(self, tick: int, name: str) -> None:
        if self._task.goal is not None:
            raise ProtocolViolation(f"goal.accepted, but goal `{self._task.goal.name}` is under way")
        self.rest(tick)
        if self._task.waits:
            raise ProtocolViolation(f"goal.accepted `{name[:60]}`, but the robot is to stay where it is for a while")
        following = self._task.following
        if following is None or name not in ("", following.name):
            waits = "none is waiting" if following is None else f"the next one is `{following.name}`"
            raise ProtocolViolation(f"goal.accepted `{name[:60]}`, but {waits}")
        self._events += self._task.next(tick)

    def _current(self, kind: str, name: str) -> None:
        goal = self._task.goal
        if goal is None or name not in ("", goal.name):
            under_way = "none is under way" if goal is None else f"the current one is `{goal.name}`"
            raise ProtocolViolation(f"{kind} `{name[:60]}`, but {under_way}")

    def _cancel(self, tick: int, name: str) -> None:
        goal = self._task.goal
        if name in self._dropped and (goal is None or goal.name != name):
            self._dropped.discard(name)
            return
        self._current("goal.canceled", name)
        self._events += self._task.cancel(tick)


def _code(told: Any) -> ErrorCode | int:
    """Return Nav2's error code for a number or name; unknown numbers are kept."""
    if told is None:
        return ErrorCode.NAVIGATE_UNKNOWN
    if isinstance(told, str) and told in ErrorCode.__members__:
        return ErrorCode[told]
    if isinstance(told, int) and not isinstance(told, bool) and 0 <= told <= MAX_ERROR_CODE:
        return error_code(told)
    raise ProtocolViolation(f"goal.failed with the error code {str(told)[:60]!r}")


def _plain(data: dict[str, Any]) -> dict[str, Value]:
    """Return the data of an event, limited in size."""
    if len(str(data)) > MAX_TEXT_LENGTH:
        raise ProtocolViolation("an event with too much data")
    return data
