"""When a run is over."""

from collections.abc import Iterable

from simscen.core.clock import Clock
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision

TIME_LIMIT = "time limit"


class EndCondition:
    """Ends a robot's part in a run a while after its navigation task has ended, or at the time limit.

    It hears of every beat of the robot that has events. A task that was given anew in the meantime (a goal sent by an
    event) takes the ending back. A run ends with the first sample of the truth from then on, so that all its samples
    are evenly spaced: what is derived from them (accelerations, windows of time) means the same at its end as before.
    """

    def __init__(self, clock: Clock, time_limit: float, linger: float, idle: bool = False) -> None:
        """`idle`: the robot has no task until it is given one, so that nobody waits for it."""
        self._limit = clock.ticks(time_limit)
        self._linger = clock.ticks(linger)
        self._over: int | None = 0 if idle else None
        self.earliest_tick = self._earliest()
        """The tick before which the robot's part is not over, as far as known."""

    def update(self, decision: Decision) -> None:
        """What the stack decided at a beat; tell each in which something happened."""
        for event in decision.events:
            if event.kind == EventKind.NAVIGATION_ENDED:
                self._over = event.tick + self._linger
            elif event.kind == EventKind.GOAL_ACCEPTED:
                self._over = None
        self.earliest_tick = self._earliest()

    def _earliest(self) -> int:
        return self._limit if self._over is None else min(self._over, self._limit)

    def reached(self, tick: int) -> Event | None:
        """The event that ends the robot's part at this beat, which samples the truth, or None."""
        if self._over is not None and tick >= self._over:
            return Event(tick, EventKind.RUN_ENDED, "navigation ended")
        if tick >= self._limit:
            return Event(tick, EventKind.RUN_ENDED, TIME_LIMIT)
        return None


def run_end(tick: int, endings: Iterable[EndCondition]) -> Event | None:
    """The event that ends a run at this beat, which samples the truth, or None: it ends when all its robots have."""
    last: Event | None = None
    for ending in endings:
        end = ending.reached(tick)
        if end is None:
            return None
        last = end if last is None or end.name == TIME_LIMIT else last
    return last
