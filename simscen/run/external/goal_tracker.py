"""Track the goals of an external stack from the events that the stack reports.

A stack reports when it accepts a goal and when a goal ends. The tracker checks the order of these reports, and adds
events for preempted goals and for the end of the task.
"""

from typing import Any

from simscen.core.clock import Clock
from simscen.core.messages.goals import Goal, Mode
from simscen.core.messages.navigation import ErrorCode, error_code
from simscen.core.records.events import Event, EventKind
from simscen.run.external.protocol import ProtocolViolation
from simscen.stack.tasks import Task

MAX_ERROR_CODE = 65_535
"""Largest error code; Nav2's error codes are uint16."""
MAX_TEXT_LENGTH = 4096
"""Maximum number of characters of a name, of a message, and of the data of an event."""
_UNRESTRICTED_KINDS = {kind.value for kind in EventKind if kind.value.split(".")[0] in ("plan", "recovery")} | {
    EventKind.ROBOT_HELD.value,
    EventKind.ROBOT_RELEASED.value,
}
"""Kinds of events that a stack may report at any time."""


class GoalTracker:
    """Goals of a robot, with their states as the stack reports them. Collects the events for the log."""

    def __init__(self, stop_on_failure: bool, tick_rate: int, mode: Mode = "navigate_to_pose") -> None:
        """If `stop_on_failure`, a failed goal ends the task. `mode` is the Nav2 action that receives the goals."""
        self._events: list[Event] = []
        self._task = Task(stop_on_failure, clock=Clock(tick_rate), mode=mode)
        self._rate = tick_rate
        self._dropped_goals: set[str] = set()
        """Names of goals that were preempted or timed out. A later cancellation of these goals is ignored."""

    def start(self, goals: tuple[Goal, ...]) -> None:
        """Start the task with these goals. No goal is accepted yet."""
        self._task.start(goals)

    @property
    def goal(self) -> Goal | None:
        """Current goal; None before the first goal is accepted, between two goals, and after the task."""
        return self._task.goal

    def preempt(self, tick: int, goal: Goal) -> None:
        """Replace the current goal by `goal`, which the stack must accept next."""
        self._ignore_cancellation()
        self._events += self._task.preempt(tick, goal)

    def process(self, tick: int, report: dict[str, Any]) -> None:
        """Process an event from the stack, with the keys `kind`, `name`, and `data`. Raises ProtocolViolation."""
        kind, name, data = report.get("kind"), report.get("name", ""), report.get("data", {})
        if not isinstance(kind, str) or not isinstance(name, str) or not isinstance(data, dict):
            raise ProtocolViolation(f"an invalid event: {str(report)[:100]}")
        if report.get("tick", tick) != tick:
            raise ProtocolViolation(f"an event of tick {report['tick']} at tick {tick}")
        match kind:
            case "goal.accepted":
                self._accept_goal(tick, name)
            case "goal.reached":
                self._require_current(kind, name)
                self._events += self._task.record_reached(tick)
            case "goal.passed":
                self._require_current(kind, name)
                if self._task.goal is not None and not self._task.goal.via:
                    raise ProtocolViolation(f"goal.passed `{name[:60]}`, which is a goal without `via`")
                self._events += self._task.record_passed(tick)
            case "goal.failed":
                self._require_current(kind, name)
                code, message = _to_error_code(data.get("error_code")), str(data.get("message", ""))[:MAX_TEXT_LENGTH]
                self._events += self._task.record_failed(tick, code, message)
            case "goal.canceled":
                self._cancel_goal(tick, name)
            case _ if kind in _UNRESTRICTED_KINDS:
                if len(str(data)) > MAX_TEXT_LENGTH:
                    raise ProtocolViolation("an event with too much data")
                self._events.append(Event(tick, EventKind(kind), name[:MAX_TEXT_LENGTH], data))
            case _:
                raise ProtocolViolation(f"an event `{kind[:60]}`, which a stack may not report")

    def advance(self, tick: int) -> None:
        """End the wait at a goal if its time is over at `tick`. This can end the task."""
        self._events += self._task.end_wait(tick)

    def fail_if_timed_out(self, tick: int) -> bool:
        """Fail the current goal if its timeout has passed; return whether this is the case."""
        goal = self._task.goal
        if goal is None or goal.timeout is None or tick - self._task.since <= goal.timeout * self._rate:
            return False
        self._ignore_cancellation()
        message = f"the timeout of {goal.timeout:g} s has passed"
        self._events += self._task.record_failed(tick, ErrorCode.NAVIGATE_TIMEOUT, message)
        return True

    def take_events(self) -> tuple[Event, ...]:
        """Return the events since the last call."""
        events, self._events = tuple(self._events), []
        return events

    def _ignore_cancellation(self) -> None:
        """Ignore a later `goal.canceled` for the current goal."""
        if self._task.goal is not None:
            self._dropped_goals.add(self._task.goal.name)

    def _accept_goal(self, tick: int, name: str) -> None:
        """Process the acceptance of a goal. Raises ProtocolViolation if it is not the next goal."""
        if self._task.goal is not None:
            raise ProtocolViolation(f"goal.accepted, but goal `{self._task.goal.name}` is active")
        self.advance(tick)
        if self._task.is_waiting:
            raise ProtocolViolation(f"goal.accepted `{name[:60]}`, but the robot must still wait at its last goal")
        following = self._task.upcoming_goal
        if following is None or name not in ("", following.name):
            expected = "there is no next goal" if following is None else f"the next goal is `{following.name}`"
            raise ProtocolViolation(f"goal.accepted `{name[:60]}`, but {expected}")
        self._events += self._task.accept_next(tick)

    def _require_current(self, kind: str, name: str) -> None:
        """Raise ProtocolViolation if no goal is active, or if the report has the name of another goal.

        An empty name stands for the current goal.
        """
        goal = self._task.goal
        if goal is None or name not in ("", goal.name):
            active = "no goal is active" if goal is None else f"the current goal is `{goal.name}`"
            raise ProtocolViolation(f"{kind} `{name[:60]}`, but {active}")

    def _cancel_goal(self, tick: int, name: str) -> None:
        """Process the cancellation of a goal. Ignores goals that were preempted or timed out before."""
        goal = self._task.goal
        if name in self._dropped_goals and (goal is None or goal.name != name):
            self._dropped_goals.discard(name)
            return
        self._require_current("goal.canceled", name)
        self._events += self._task.cancel(tick)


def _to_error_code(value: Any) -> ErrorCode | int:
    """Return Nav2's error code for a number, a name, or None (NAVIGATE_UNKNOWN); unknown numbers are returned as is.

    Raises ProtocolViolation for other values.
    """
    if value is None:
        return ErrorCode.NAVIGATE_UNKNOWN
    if isinstance(value, str) and value in ErrorCode.__members__:
        return ErrorCode[value]
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MAX_ERROR_CODE:
        return error_code(value)
    raise ProtocolViolation(f"goal.failed with the error code {str(value)[:60]!r}")
