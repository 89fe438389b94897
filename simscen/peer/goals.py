"""Goal queue of a stack: holds the goals from simscen, and collects the events about goals for simscen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence


ROUNDING_S = 1e-8
"""Tolerance in seconds for times that come from integer nanoseconds."""


class Goal(NamedTuple):
    """Goal pose in the map frame, with tolerances in m and rad.

    timeout:  limit in simulated seconds; None without a limit
    via:      whether the robot passes the goal without stopping and with any heading
    wait:     simulated seconds that the robot stays at the goal
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
    def from_content(cls, content: dict[str, Any]) -> Goal:
        """Return the goal from its JSON object in a GOAL or PREEMPT frame."""
        fields = {"via": False, "wait": 0.0, **content}
        return cls(*(fields[name] for name in cls._fields))


class Goals:
    """Queue of goals, and the events to send with the next answer.

    Attributes:
        current: Accepted goal that has not ended; None without such a goal.
        waiting: Goals after the current goal, in order.
        now: Simulated time in seconds. The caller updates it at every step.
    """

    def __init__(self) -> None:
        self.current: Goal | None = None
        self.waiting: list[Goal] = []
        self.now = 0.0
        self._wait_until = 0.0
        self._events: list[dict[str, Any]] = []

    def start(self, goals: Sequence[Goal]) -> None:
        """Replace all goals by `goals`."""
        self.current, self.waiting, self._wait_until = None, list(goals), 0.0

    def accept(self) -> Goal | None:
        """Return the current goal. If no goal is current, accept the next goal first.

        Return None if there is no goal, or while the robot waits at the previous goal.
        """
        if self.current is None and self.waiting and self.now >= self._wait_until - ROUNDING_S:
            self.current = self.waiting.pop(0)
            self.report("goal.accepted", self.current.name)
        return self.current

    def reached(self) -> None:
        """Report the current goal as reached, or as passed if it has `via`, and start the `wait` at the goal.

        Raises ValueError without a current goal.
        """
        goal = self.current
        self._end("goal.passed" if goal is not None and goal.via else "goal.reached")
        if goal is not None and goal.wait:
            self._wait_until = self.now + goal.wait

    @property
    def ahead(self) -> list[Goal]:
        """Goals that the robot reaches after the current goal without a stop in between.

        If the current goal has `via`, these are the next goals with `via`, and after them the first goal without `via`,
        at which the robot stops. Otherwise the robot stops at the current goal, and the list is empty.
        """
        if self.current is None or not self.current.via:
            return []
        last = next((k for k, goal in enumerate(self.waiting) if not goal.via), len(self.waiting) - 1)
        return self.waiting[: last + 1]

    def failed(self, error_code: int | str, message: str = "", go_on: bool = False) -> None:
        """Report the current goal as failed, with the number or name of a Nav2 error code.

        The goals `ahead` are dropped. If `go_on` is False, all other goals are dropped, too. Raises ValueError without
        a current goal.
        """
        self._drop("goal.failed", error_code=error_code, message=message)
        if not go_on:
            self.waiting = []

    def preempt(self, goal: Goal) -> None:
        """Cancel the current goal and the goals `ahead`, and insert `goal` as the next goal."""
        if self.current is not None:
            self._drop("goal.canceled")
        self._wait_until = 0.0
        self.waiting.insert(0, goal)

    def cancel(self, everything: bool) -> None:
        """Cancel the current goal and the goals `ahead`. If `everything` is True, cancel all other goals, too."""
        if self.current is not None:
            self._drop("goal.canceled")
        if everything:
            self.waiting = []

    def report(self, kind: str, name: str = "", **data: Any) -> None:
        """Add an event to the next answer, e.g. `report("recovery.started", "spin")`."""
        self._events.append({"kind": kind, "name": name, "data": data})

    def take_events(self) -> list[dict[str, Any]]:
        """Return the events since the last call."""
        events, self._events = self._events, []
        return events

    def _drop(self, kind: str, **data: Any) -> None:
        """End the current goal with an event of this kind, and drop the goals `ahead`."""
        ahead_count = len(self.ahead)
        self._end(kind, **data)
        self.waiting = self.waiting[ahead_count:]

    def _end(self, kind: str, **data: Any) -> None:
        """End the current goal with an event of this kind. Raises ValueError without a current goal."""
        if self.current is None:
            raise ValueError(f"{kind} without a goal: accept it first")
        self.report(kind, self.current.name, **data)
        self.current = None
