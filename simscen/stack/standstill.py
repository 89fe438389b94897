"""Events that explain why a robot with a goal stands still."""

from collections.abc import Callable

from simscen.core.records.events import Event, EventKind

REPORT_AFTER_S = 1.0
"""Time for which the robot must wait for the same component before that is reported."""


class StandstillReporter:
    """Create an event when a component has held the robot for a while, and another when it no longer does."""

    def __init__(self, tick_rate: int) -> None:
        """Take the tick rate in Hz."""
        self._after = round(REPORT_AFTER_S * tick_rate)
        self.holds = ""
        """Name of the component that holds the robot; empty if none does."""
        self._since, self._is_reported = 0, False

    def held(self, tick: int, by: str, why: Callable[[], str]) -> tuple[Event, ...]:
        """Record that the robot waits for the component `by`. `why` returns the message for the event."""
        ended: tuple[Event, ...] = ()
        if by != self.holds:
            ended = self.over(tick)
            self.holds, self._since = by, tick
        if self._is_reported or tick - self._since < self._after:
            return ended
        self._is_reported = True
        return (*ended, Event(tick, EventKind.ROBOT_HELD, by, {"message": why()}))

    def over(self, tick: int) -> tuple[Event, ...]:
        """Record that nothing holds the robot any more, or that it has no goal."""
        if not self.holds:
            return ()
        by, is_reported, self.holds, self._is_reported = self.holds, self._is_reported, "", False
        return (Event(tick, EventKind.ROBOT_RELEASED, by),) if is_reported else ()
