"""Conversion of simulated time between physics ticks, seconds, nanoseconds, and ROS time."""

from dataclasses import dataclass

NS_PER_SECOND = 1_000_000_000

Stamp = tuple[int, int]
"""Time as in builtin_interfaces/Time: seconds since the start of the run, and nanoseconds of the current second."""


@dataclass(frozen=True)
class Clock:
    """Converts ticks to other units of time and back, and rates to periods.

    `rate` is the number of physics ticks per second; 240 is the default of PyBullet. Raises ValueError unless `rate` is
    in 1 … 999,999,999.
    """

    rate: int = 240

    def __post_init__(self) -> None:
        if not 1 <= self.rate < NS_PER_SECOND:
            raise ValueError(f"the clock rate must be in 1 … {NS_PER_SECOND - 1:,} Hz, got {self.rate}")

    def seconds(self, tick: int) -> float:
        """Return the simulated time of a tick in s."""
        return tick / self.rate

    def ticks(self, seconds: float) -> int:
        """Return the number of whole ticks nearest to `seconds`."""
        return round(seconds * self.rate)

    def nanoseconds(self, tick: int) -> int:
        """Return the nanoseconds from the start of the run to a tick, rounded down."""
        return tick * NS_PER_SECOND // self.rate

    def stamp(self, tick: int) -> Stamp:
        """Return the ROS time of a tick, rounded down to whole nanoseconds."""
        return divmod(tick * NS_PER_SECOND // self.rate, NS_PER_SECOND)

    def tick_at(self, nanoseconds: int) -> int:
        """Return the first tick at or after a time in nanoseconds since the start of the run."""
        return -(-nanoseconds * self.rate // NS_PER_SECOND)

    def period(self, hertz: float) -> int:
        """Return the period of the rate `hertz` in ticks. Raises ValueError unless it is a whole number of ticks."""
        period = self.rate / hertz if hertz > 0 else 0.0
        if period < 1 or abs(period - round(period)) > 1e-9:
            nearest = self.nearest_rate(hertz)
            raise ValueError(f"{hertz:g} Hz does not divide {self.rate} Hz; the nearest that does is {nearest:g} Hz")
        return round(period)

    def nearest_rate(self, hertz: float) -> float:
        """Return the nearest rate in Hz that divides the clock rate or has a period of 1 to 10 whole seconds."""
        periods = [p for p in range(1, 10 * self.rate + 1) if self.rate % p == 0 or p % self.rate == 0]
        return min((self.rate / p for p in periods), key=lambda rate: (abs(rate - hertz), rate))
