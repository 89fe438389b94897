"""When a run is over."""

from simscen.core.events import Event, EventKind
from simscen.core.time import Clock
from simscen.core.trace import Decision


class Ending:
    """Ends a run a while after its navigation task has ended, or at its time limit.

    A task that was given anew in the meantime (a goal sent by an event) takes the ending back. A run ends with a
    sample of the truth, whatever the rates of truth, sensors and controller: at a beat that takes one anyway, or at
    the first beat at which an end is due.
    """

    def __init__(self, clock: Clock, time_limit: float, linger: float) -> None:
        self._limit = clock.ticks(time_limit)
        self._linger = clock.ticks(linger)
        self._over: int | None = None

    def due(self, tick: int) -> bool:
        """Whether, from all that was heard before, the run is to end at this beat: then the truth is needed."""
        return self.reached(tick) is not None

    def heard(self, decision: Decision) -> None:
        """What the stack decided at a beat; tell each of them."""
        for event in decision.events:
            if event.kind == EventKind.NAVIGATION_ENDED:
                self._over = event.tick + self._linger
            elif event.kind == EventKind.GOAL_ACCEPTED:
                self._over = None

    def reached(self, tick: int) -> Event | None:
        """The event that ends the run at this beat, or None."""
        if self._over is not None and tick >= self._over:
            return Event(tick, EventKind.RUN_ENDED, "navigation ended")
        if tick >= self._limit:
            return Event(tick, EventKind.RUN_ENDED, "time limit")
        return None
