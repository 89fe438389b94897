"""Conversion between ticks and nanoseconds in integers."""

NS_PER_SECOND = 1_000_000_000

Stamp = tuple[int, int]
"""builtin_interfaces/Time: seconds and nanoseconds."""


class SimTime:
    """Simulated time of a clock with `rate` ticks per second, 1 to 999,999,999.

    A tick is rarely a whole number of nanoseconds (1/240 s is not), so times are rounded down. `tick` inverts the
    rounding exactly.
    """

    def __init__(self, rate: int) -> None:
        if not 1 <= rate < NS_PER_SECOND:
            raise ValueError(f"a clock rate of {rate} Hz cannot be expressed in nanoseconds")
        self.rate = rate
        self._last: tuple[int, Stamp] = (0, (0, 0))  # most messages of a step have the stamp of that step

    def nanoseconds(self, tick: int) -> int:
        """Return the nanoseconds from the start of the run to a tick."""
        return tick * NS_PER_SECOND // self.rate

    def stamp(self, tick: int) -> Stamp:
        """Return the ROS time of a tick."""
        if tick != self._last[0]:
            self._last = tick, divmod(tick * NS_PER_SECOND // self.rate, NS_PER_SECOND)
        return self._last[1]

    def tick(self, nanoseconds: int) -> int:
        """Return the tick for which `nanoseconds` or `stamp` returned this time."""
        return -(-nanoseconds * self.rate // NS_PER_SECOND)
