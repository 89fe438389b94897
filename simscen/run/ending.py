"""When a run is over."""

from simscen.core.events import Event, EventKind
from simscen.core.time import Clock
from simscen.core.trace import Moment


class Ending:
    """Ends a run a while after its navigation task has ended, or at its time limit.

    A task that was given anew in the meantime (a goal sent by an event) takes the ending back.
    """

    def __init__(self, clock: Clock, time_limit: float, linger: float) -> None:
        self._limit = clock.ticks(time_limit)
        self._linger = clock.ticks(linger)
        self._over: int | None = None

    def reached(self, moment: Moment) -> Event | None:
        """The event that ends the run at this moment, or None."""
        for event in moment.decision.events:
            if event.kind == EventKind.NAVIGATION_ENDED:
                self._over = event.tick + self._linger
            elif event.kind == EventKind.GOAL_ACCEPTED:
                self._over = None
        if self._over is not None and moment.tick >= self._over:
            return Event(moment.tick, EventKind.RUN_ENDED, "navigation ended")
        if moment.tick >= self._limit:
            return Event(moment.tick, EventKind.RUN_ENDED, "time limit")
        return None
