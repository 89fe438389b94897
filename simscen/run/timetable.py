"""At which ticks anything is due."""

from collections.abc import Iterable


class Timetable:
    """The ticks that are a multiple of at least one period, or so much later than one, in order.

    Nothing is tabulated: the pattern repeats only after the least common multiple of the periods, which may be long.
    """

    def __init__(self, periods: Iterable[int], later: Iterable[tuple[int, int]] = ()) -> None:
        """`later`: periods, and ticks after each multiple."""
        beats = {(period, 0) for period in periods} | {(period, ticks % period) for period, ticks in later}
        first, *rest = sorted(beat for beat in beats if not any(_among(beat, other) for other in beats))
        (self._period, self._late), self._rest = first, rest

    def due(self, tick: int) -> bool:
        """Whether anything is due at `tick`."""
        return self.until_next(tick - 1) == 1

    def until_next(self, tick: int) -> int:
        """How many ticks lie between `tick` and the next one at which something is due; at least 1."""
        until = self._period - (tick - self._late) % self._period
        if self._rest:  # of most robots a single one is left
            return min(until, *[period - (tick - ticks) % period for period, ticks in self._rest])
        return until


def _among(beat: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether all ticks of a beat are among those of another."""
    (period, ticks), (finer, its) = beat, other
    return beat != other and period % finer == 0 and ticks % finer == its
