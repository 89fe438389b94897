"""Goals of a stack in their order, and the events that it reports about them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence


ROUNDING_S = 1e-8
"""Tolerance in seconds for times that come from integer nanoseconds."""


class Goal(NamedTuple):
    """A pose to reach in the map, within tolerances (m, rad), in at most `timeout` simulated seconds (None = any).

    `via`: pass without stopping, with any heading, in one drive with the next goal. `wait`: simulated seconds to stay
    at the goal.
    """

    name: str
    x: float
    y: float
    yaw: float
    xy_tolerance: float
    yaw_tolerance: float
    timeout: float | None = None
    via: bool = False
    wait: float = 0.0

    @classmethod
    def of(cls, content: dict[str, Any]) -> Goal:
        """Return the goal from the content of GOAL or PREEMPT."""
        fields = {"via": False, "wait": 0.0, **content}
        return cls(*(fields[name] for name in cls._fields))


class Goals:
    """The list of goals, and the events for the next answer.

    A goal that simscen cancels or preempts is dropped and reported as canceled.
    """

    def __init__(self) -> None:
        self.current: Goal | None = None
        self.waiting: list[Goal] = []
        self.now = 0.0
        """Simulated seconds; updated by the caller at every step."""
        self._wait_until = 0.0
        self._events: list[dict[str, Any]] = []

    def start(self, goals: Sequence[Goal]) -> None:
        """Replace all goals by `goals`, to be driven to in this order."""
        self.current, self.waiting, self._wait_until = None, list(goals), 0.0

    def accept(self) -> Goal | None:
        """Accept the next goal unless there is a current one; return the current goal, None if there is none yet."""
        if self.current is None and self.waiting and self.now >= self._wait_until - ROUNDING_S:
            self.current = self.waiting.pop(0)
            self.report("goal.accepted", self.current.name)
        return self.current

    def reached(self) -> None:
        """Report the current goal as reached, or as passed for `via`; then wait for the time given by its `wait`."""
        goal = self.current
        self._end("goal.passed" if goal is not None and goal.via else "goal.reached")
        if goal is not None and goal.wait:
            self._wait_until = self.now + goal.wait

    @property
    def ahead(self) -> list[Goal]:
        """The goals that follow the current one in the same drive."""
        if self.current is None or not self.current.via:
            return []
        stop = next((k for k, goal in enumerate(self.waiting) if not goal.via), len(self.waiting) - 1)
        return self.waiting[: stop + 1]

    def failed(self, error_code: int | str, message: str = "", go_on: bool = False) -> None:
        """Report the current goal as failed, with one of Nav2's error codes by number or name.

        Without `go_on` all other goals are dropped, as FollowWaypoints does with stop_on_failure.
        """
        self._drop("goal.failed", error_code=error_code, message=message)
        if not go_on:
            self.waiting = []

    def preempted(self, goal: Goal) -> None:
        """Cancel the current goal and put another one first."""
        if self.current is not None:
            self._drop("goal.canceled")
        self._wait_until = 0.0
        self.waiting.insert(0, goal)

    def canceled(self, everything: bool) -> None:
        """Cancel the current goal; with `everything`, also all after it."""
        if self.current is not None:
            self._drop("goal.canceled")
        if everything:
            self.waiting = []

    def report(self, kind: str, name: str = "", **data: Any) -> None:
        """Report an event with the next answer, e.g. `report("recovery.started", "spin")`."""
        self._events.append({"kind": kind, "name": name, "data": data})

    def take_events(self) -> list[dict[str, Any]]:
        """Return the events since the last call."""
        events, self._events = self._events, []
        return events

    def _drop(self, kind: str, **data: Any) -> None:
        """End the current goal, and drop the goals that follow it in the same drive."""
        ahead = len(self.ahead)
        self._end(kind, **data)
        self.waiting = self.waiting[ahead:]

    def _end(self, kind: str, **data: Any) -> None:
        if self.current is None:
            raise ValueError(f"{kind} without a goal: accept it first")
        self.report(kind, self.current.name, **data)
        self.current = None
