"""Conditions that end a run."""

from collections.abc import Iterable

from simscen.core.clock import Clock
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision

TIME_LIMIT = "time limit"


class EndCondition:
    """Condition that ends a robot's part of a run: some time after its navigation task, or at the time limit.

    A goal that an event sends in the meantime withdraws the end. A run ends at a regular sample of the truth, or
    exactly at the time limit, where an additional sample is taken.
    """

    def __init__(self, clock: Clock, time_limit: float, linger: float, idle: bool = False) -> None:
        """`time_limit` and `linger` in seconds. An `idle` robot has no task at first and does not delay the end."""
        self.limit = clock.ticks(time_limit)
        """Tick of the time limit."""
        self._linger = clock.ticks(linger)
        self._over: int | None = 0 if idle else None
        self.earliest_tick = self._earliest()
        """Earliest tick at which the robot's part can end."""

    def update(self, decision: Decision) -> None:
        """Update with a decision. Must be called for each decision that has events."""
        for event in decision.events:
            if event.kind == EventKind.NAVIGATION_ENDED:
                self._over = event.tick + self._linger
            elif event.kind == EventKind.GOAL_ACCEPTED:
                self._over = None
        self.earliest_tick = self._earliest()

    def _earliest(self) -> int:
        return self.limit if self._over is None else min(self._over, self.limit)

    def reached(self, tick: int) -> Event | None:
        """Return the event that ends the robot's part at this tick, or None. The tick must have a truth sample."""
        if self._over is not None and tick >= self._over:
            return Event(tick, EventKind.RUN_ENDED, "navigation ended")
        if tick >= self.limit:
            return Event(tick, EventKind.RUN_ENDED, TIME_LIMIT)
        return None


def run_end(tick: int, endings: Iterable[EndCondition]) -> Event | None:
    """Return the event that ends the run at this tick, or None while any robot continues."""
    last: Event | None = None
    for ending in endings:
        end = ending.reached(tick)
        if end is None:
            return None
        last = end if last is None or end.name == TIME_LIMIT else last
    return last
