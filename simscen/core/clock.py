"""Time is a whole number of physics ticks."""

from dataclasses import dataclass

DEFAULT_TICK_RATE = 240


@dataclass(frozen=True)
class Clock:
    """Converts between ticks and seconds, and rates into whole periods.

    `rate` is the number of physics ticks a second.
    """

    rate: int = DEFAULT_TICK_RATE

    def seconds(self, tick: int) -> float:
        """The simulated time of `tick` in seconds."""
        return tick / self.rate

    def ticks(self, seconds: float) -> int:
        """The number of whole ticks nearest to `seconds`."""
        return round(seconds * self.rate)

    def period(self, hertz: float) -> int:
        """Ticks between two samples of something that happens `hertz` times a second.

        Raises ValueError, naming the nearest rates that fit, when the rate does not divide the clock.
        """
        period = self.rate / hertz if hertz > 0 else 0.0
        if period < 1 or abs(period - round(period)) > 1e-9:
            fitting = self.nearest_rate(hertz)
            raise ValueError(f"{hertz:g} Hz does not divide {self.rate} Hz; the nearest that does is {fitting:g} Hz")
        return round(period)

    def nearest_rate(self, hertz: float) -> float:
        """The rate nearest to `hertz` that gives a whole number of ticks a period."""
        periods = [p for p in range(1, 10 * self.rate + 1) if self.rate % p == 0 or p % self.rate == 0]
        return min((self.rate / p for p in periods), key=lambda rate: (abs(rate - hertz), rate))
