"""At which ticks anything is due."""

from collections.abc import Iterable


class Timetable:
    """The ticks that are a multiple of at least one period, in order.

    Nothing is tabulated: the pattern repeats only after the least common multiple of the periods, which may be long.
    """

    def __init__(self, periods: Iterable[int]) -> None:
        self._periods = tuple(sorted(set(periods)))

    def due(self, tick: int) -> bool:
        """Whether anything is due at `tick`."""
        return any(tick % period == 0 for period in self._periods)

    def until_next(self, tick: int) -> int:
        """How many ticks lie between `tick` and the next one at which something is due; at least 1."""
        return min(period - tick % period for period in self._periods)
