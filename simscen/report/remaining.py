"""How far a session is, and how long it will go on."""

from collections.abc import Callable

from simscen.core.records.session_events import RunFinished, RunStarted, SessionEvent, SessionStarted

ENOUGH = 2
"""Runs that must have ended before what they took says anything of the others."""


class Remaining:
    """Listens to a session. `clock` is in seconds; what was kept from an earlier session took none of them."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._begun: float | None = None
        self._started: set[object] = set()
        self._total, self._done, self._run = 0, 0, 0

    def __call__(self, event: SessionEvent) -> None:
        """Take one event."""
        match event:
            case SessionStarted():
                self._total = event.total
            case RunStarted():
                self._begun = self._clock() if self._begun is None else self._begun
                self._started.add(event.key)
            case RunFinished():
                self._done += 1
                self._run += event.key in self._started
            case _:
                pass

    @property
    def told(self) -> str:
        """12 of 88, about 40 s left; "" for a single run."""
        if self._total < 2:
            return ""
        seconds = self.seconds
        return f"{self._done} of {self._total}" + ("" if seconds is None else f", about {_rounded(seconds)} left")

    @property
    def seconds(self) -> float | None:
        """How long the rest takes if it goes on like this; None = too early to say."""
        if self._begun is None or self._run < ENOUGH:
            return None
        return (self._clock() - self._begun) / self._run * (self._total - self._done)


def _rounded(seconds: float) -> str:
    """In steps that do not flicker."""
    if seconds < 90:
        return f"{max(5, 5 * round(seconds / 5))} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{seconds / 3600:.1f} h"
