"""Simulated time as a whole number of physics ticks, and its conversion to nanoseconds and ROS time."""

from dataclasses import dataclass

DEFAULT_TICK_RATE_HZ = 240


@dataclass(frozen=True)
class Clock:
    """Conversion between ticks and seconds, and from rates to whole periods.

    `rate` is the number of physics ticks per second.
    """

    rate: int = DEFAULT_TICK_RATE_HZ

    def seconds(self, tick: int) -> float:
        """Return the simulated time of `tick` in seconds."""
        return tick / self.rate

    def ticks(self, seconds: float) -> int:
        """Return the number of whole ticks nearest to `seconds`."""
        return round(seconds * self.rate)

    def period(self, hertz: float) -> int:
        """Return the number of ticks between two samples at a rate of `hertz`.

        Raises ValueError, with the nearest rate that fits, if the rate does not divide the clock rate.
        """
        period = self.rate / hertz if hertz > 0 else 0.0
        if period < 1 or abs(period - round(period)) > 1e-9:
            fitting = self.nearest_rate(hertz)
            raise ValueError(f"{hertz:g} Hz does not divide {self.rate} Hz; the nearest that does is {fitting:g} Hz")
        return round(period)

    def nearest_rate(self, hertz: float) -> float:
        """Return the rate nearest to `hertz` that has a period of whole ticks."""
        periods = [p for p in range(1, 10 * self.rate + 1) if self.rate % p == 0 or p % self.rate == 0]
        return min((self.rate / p for p in periods), key=lambda rate: (abs(rate - hertz), rate))


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
