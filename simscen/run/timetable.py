"""At which ticks anything is due."""

import math
from collections.abc import Iterable


class Timetable:
    """The ticks that are a multiple of at least one period, in order.

    The pattern repeats after the least common multiple of the periods, so it is worked out once.
    """

    def __init__(self, periods: Iterable[int]) -> None:
        distinct = sorted(set(periods))
        self._cycle = math.lcm(*distinct)
        due = sorted({tick for period in distinct for tick in range(period, self._cycle + 1, period)})
        self._until_next = [next(tick for tick in due if tick > at) - at for at in range(self._cycle)]

    def until_next(self, tick: int) -> int:
        """How many ticks lie between `tick` and the next one at which something is due; at least 1."""
        return self._until_next[tick % self._cycle]
