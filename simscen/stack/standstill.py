"""Tells why a robot that has somewhere to go stands: what it waits for says nothing of itself."""

from collections.abc import Callable

from simscen.core.records.events import Event, EventKind

REPORT_AFTER_S = 1.0
"""Seconds that it stands for the same reason until that is told; a plan or a scan may well be a little late."""


class StandstillReporter:
    """Turns what holds the robot at each step into an event when it has for a while, and one when it no longer does."""

    def __init__(self, tick_rate: int) -> None:
        self._after = round(REPORT_AFTER_S * tick_rate)
        self.holds = ""
        """What holds it; "" for nothing."""
        self._since, self._told = 0, False

    def held(self, tick: int, by: str, why: Callable[[], str]) -> tuple[Event, ...]:
        """It stands for want of what `by` has to say; asked `why` where that is to be told."""
        ended: tuple[Event, ...] = ()
        if by != self.holds:
            ended = self.over(tick)
            self.holds, self._since = by, tick
        if self._told or tick - self._since < self._after:
            return ended
        self._told = True
        return (*ended, Event(tick, EventKind.ROBOT_HELD, by, {"message": why()}))

    def over(self, tick: int) -> tuple[Event, ...]:
        """Nothing holds it, or it has nowhere to go any more."""
        if not self.holds:
            return ()
        by, told, self.holds, self._told = self.holds, self._told, "", False
        return (Event(tick, EventKind.ROBOT_RELEASED, by),) if told else ()
