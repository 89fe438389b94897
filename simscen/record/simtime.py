"""Ticks as nanoseconds and back, in whole numbers."""

NS_PER_SECOND = 1_000_000_000


Stamp = tuple[int, int]  # builtin_interfaces/Time: whole seconds and the nanoseconds beyond them


class SimTime:
    """Simulated time of a clock with `rate` ticks a second.

    A tick is rarely a whole number of nanoseconds (1/240 s is not), so it is written rounded down; `tick` undoes that
    exactly for every rate below 1 GHz.
    """

    def __init__(self, rate: int) -> None:
        if not 1 <= rate < NS_PER_SECOND:
            raise ValueError(f"a clock of {rate} Hz cannot be told in nanoseconds")
        self.rate = rate
        self._last: tuple[int, Stamp] = (0, (0, 0))  # most of what a beat says is of that beat

    def nanoseconds(self, tick: int) -> int:
        """Nanoseconds since the start of the run."""
        return tick * NS_PER_SECOND // self.rate

    def stamp(self, tick: int) -> Stamp:
        """The same as a ROS time."""
        if tick != self._last[0]:
            self._last = tick, divmod(tick * NS_PER_SECOND // self.rate, NS_PER_SECOND)
        return self._last[1]

    def tick(self, nanoseconds: int) -> int:
        """The tick that `nanoseconds` was written for."""
        return -(-nanoseconds * self.rate // NS_PER_SECOND)
