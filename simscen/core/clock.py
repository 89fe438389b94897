"""Simulated time as a whole number of physics ticks, and its conversion to nanoseconds and ROS time."""

from dataclasses import dataclass

DEFAULT_TICK_RATE_HZ = 240
"""Physics ticks per second; the default of PyBullet."""


@dataclass(frozen=True)
class Clock:
    """Converts between ticks and seconds, and rates to periods in ticks. `rate` is in physics ticks per second."""

    rate: int = DEFAULT_TICK_RATE_HZ

    def seconds(self, tick: int) -> float:
        """Return the simulated time of a tick in s."""
        return tick / self.rate

    def ticks(self, seconds: float) -> int:
        """Return the number of whole ticks nearest to `seconds`."""
        return round(seconds * self.rate)

    def period(self, hertz: float) -> int:
        """Return the number of ticks between two samples at a rate of `hertz`.

        Raises ValueError, with the result of `nearest_rate`, if the period is not a whole number of ticks.
        """
        period = self.rate / hertz if hertz > 0 else 0.0
        if period < 1 or abs(period - round(period)) > 1e-9:
            fitting = self.nearest_rate(hertz)
            raise ValueError(f"{hertz:g} Hz does not divide {self.rate} Hz; the nearest that does is {fitting:g} Hz")
        return round(period)

    def nearest_rate(self, hertz: float) -> float:
        """Return the rate in Hz nearest to `hertz` that suits the clock.

        Suitable rates are the whole divisors of the clock rate, and rates with a period of 1 to 10 whole seconds.
        """
        periods = [p for p in range(1, 10 * self.rate + 1) if self.rate % p == 0 or p % self.rate == 0]
        return min((self.rate / p for p in periods), key=lambda rate: (abs(rate - hertz), rate))


NS_PER_SECOND = 1_000_000_000

Stamp = tuple[int, int]
"""Time as in builtin_interfaces/Time: seconds since the start of the run, and nanoseconds of the current second."""


class SimTime:
    """Converts ticks to nanoseconds and ROS time, and back.

    `rate` is the number of ticks per second, from 1 to 999,999,999; other values raise ValueError. A tick is rarely a
    whole number of nanoseconds (1/240 s is not), so times are rounded down. The method `tick` finds the exact tick
    again.
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
        """Return the tick of a time since the start of the run that was computed by `nanoseconds` or `stamp`."""
        return -(-nanoseconds * self.rate // NS_PER_SECOND)
