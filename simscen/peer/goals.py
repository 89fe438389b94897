"""The task of a peer: goals in order, and what it says of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence


ROUNDING = 1e-8
"""Seconds by which a time that is told in nanoseconds may be off."""


class Goal(NamedTuple):
    """A pose to reach in the map, within tolerances (m, rad), in at most `timeout` simulated seconds (None = any).

    `via`: to be passed without a stop, whatever the heading, in one drive with the goal after it. `wait`: simulated
    seconds to stay there.
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
        """As GOAL and PREEMPT say it."""
        said = {"via": False, "wait": 0.0, **content}
        return cls(*(said[name] for name in cls._fields))


class Goals:
    """Keeps the list of goals, and the events that simscen is to hear with the next answer.

    A goal that simscen cancels or preempts is dropped, and said to be, without more ado.
    """

    def __init__(self) -> None:
        self.current: Goal | None = None
        self.waiting: list[Goal] = []
        self.now = 0.0
        """Simulated seconds; whoever takes the steps keeps it right."""
        self._stays = 0.0
        self._events: list[dict[str, Any]] = []

    def start(self, goals: Sequence[Goal]) -> None:
        """A new task."""
        self.current, self.waiting, self._stays = None, list(goals), 0.0

    def accept(self) -> Goal | None:
        """Take on the next goal, unless there is one already; None when there is nothing to do, or not yet."""
        if self.current is None and self.waiting and self.now >= self._stays - ROUNDING:
            self.current = self.waiting.pop(0)
            self.say("goal.accepted", self.current.name)
        return self.current

    def reached(self) -> None:
        """Say that the current goal is reached, or passed where it is one to pass; then stay as long as it says."""
        goal = self.current
        self._end("goal.passed" if goal is not None and goal.via else "goal.reached")
        if goal is not None and goal.wait:
            self._stays = self.now + goal.wait

    @property
    def ahead(self) -> list[Goal]:
        """What follows the current goal in the same drive."""
        if self.current is None or not self.current.via:
            return []
        stop = next((k for k, goal in enumerate(self.waiting) if not goal.via), len(self.waiting) - 1)
        return self.waiting[: stop + 1]

    def failed(self, error_code: int | str, message: str = "", go_on: bool = False) -> None:
        """Say that the current goal has failed, with one of Nav2's codes by number or name.

        Without `go_on` all others are dropped, as FollowWaypoints does with stop_on_failure.
        """
        self._drop("goal.failed", error_code=error_code, message=message)
        if not go_on:
            self.waiting = []

    def preempted(self, goal: Goal) -> None:
        """Another goal takes the place of the current one."""
        if self.current is not None:
            self._drop("goal.canceled")
        self._stays = 0.0
        self.waiting.insert(0, goal)

    def canceled(self, everything: bool) -> None:
        """The current goal is canceled; with `everything` so are all after it."""
        if self.current is not None:
            self._drop("goal.canceled")
        if everything:
            self.waiting = []

    def say(self, kind: str, name: str = "", **data: Any) -> None:
        """Tell of an event with the next answer, e.g. `say("recovery.started", "spin")`."""
        self._events.append({"kind": kind, "name": name, "data": data})

    def take(self) -> list[dict[str, Any]]:
        """What is to be said since this was last asked."""
        events, self._events = self._events, []
        return events

    def _drop(self, kind: str, **data: Any) -> None:
        """With a goal goes what follows it in the same drive."""
        ahead = len(self.ahead)
        self._end(kind, **data)
        self.waiting = self.waiting[ahead:]

    def _end(self, kind: str, **data: Any) -> None:
        if self.current is None:
            raise ValueError(f"{kind} without a goal: accept it first")
        self.say(kind, self.current.name, **data)
        self.current = None
