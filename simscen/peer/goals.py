"""The task of a peer: goals in order, and what it says of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence


class Goal(NamedTuple):
    """A pose to reach in the map, within tolerances (m, rad), in at most `timeout` simulated seconds (None = any)."""

    name: str
    x: float
    y: float
    yaw: float
    xy_tolerance: float
    yaw_tolerance: float
    timeout: float | None = None

    @classmethod
    def of(cls, content: dict[str, Any]) -> Goal:
        """As GOAL and PREEMPT say it."""
        return cls(*(content[name] for name in cls._fields))


class Goals:
    """Keeps the list of goals, and the events that simscen is to hear with the next answer.

    A goal that simscen cancels or preempts is dropped, and said to be, without more ado.
    """

    def __init__(self) -> None:
        self.current: Goal | None = None
        self.waiting: list[Goal] = []
        self._events: list[dict[str, Any]] = []

    def start(self, goals: Sequence[Goal]) -> None:
        """A new task."""
        self.current, self.waiting = None, list(goals)

    def accept(self) -> Goal | None:
        """Take on the next goal, unless there is one already; None when there is nothing left to do."""
        if self.current is None and self.waiting:
            self.current = self.waiting.pop(0)
            self.say("goal.accepted", self.current.name)
        return self.current

    def reached(self) -> None:
        """Say that the current goal is reached."""
        self._end("goal.reached")

    def failed(self, error_code: int | str, message: str = "", go_on: bool = False) -> None:
        """Say that the current goal has failed, with one of Nav2's codes by number or name.

        Without `go_on` all others are dropped, as FollowWaypoints does with stop_on_failure.
        """
        self._end("goal.failed", error_code=error_code, message=message)
        if not go_on:
            self.waiting = []

    def preempted(self, goal: Goal) -> None:
        """Another goal takes the place of the current one."""
        if self.current is not None:
            self._end("goal.canceled")
        self.waiting.insert(0, goal)

    def canceled(self, everything: bool) -> None:
        """The current goal is canceled; with `everything` so are all after it."""
        if self.current is not None:
            self._end("goal.canceled")
        if everything:
            self.waiting = []

    def say(self, kind: str, name: str = "", **data: Any) -> None:
        """Tell of an event with the next answer, e.g. `say("recovery.started", "spin")`."""
        self._events.append({"kind": kind, "name": name, "data": data})

    def take(self) -> list[dict[str, Any]]:
        """What is to be said since this was last asked."""
        events, self._events = self._events, []
        return events

    def _end(self, kind: str, **data: Any) -> None:
        if self.current is None:
            raise ValueError(f"{kind} without a goal: accept it first")
        self.say(kind, self.current.name, **data)
        self.current = None
