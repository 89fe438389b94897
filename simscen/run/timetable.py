"""At which ticks anything is due."""

from collections.abc import Iterable


class Timetable:
    """The ticks that are a multiple of at least one period, or so much later than one, in order.

    Nothing is tabulated: the pattern repeats only after the least common multiple of the periods, which may be long.
    """

    def __init__(self, periods: Iterable[int], later: Iterable[tuple[int, int]] = ()) -> None:
        """`later`: periods, and ticks after each multiple."""
        beats = {(period, 0) for period in periods} | {(period, ticks % period) for period, ticks in later}
        self._beats = tuple(sorted(beat for beat in beats if not any(_among(beat, other) for other in beats)))

    def due(self, tick: int) -> bool:
        """Whether anything is due at `tick`."""
        return self.until_next(tick - 1) == 1

    def until_next(self, tick: int) -> int:
        """How many ticks lie between `tick` and the next one at which something is due; at least 1."""
        return min([period - (tick - ticks) % period for period, ticks in self._beats])


def _among(beat: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether all ticks of a beat are among those of another: of most robots a single one is left."""
    (period, ticks), (finer, its) = beat, other
    return beat != other and period % finer == 0 and ticks % finer == its
