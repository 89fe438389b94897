"""Ticks as nanoseconds and back, in whole numbers."""

from dataclasses import dataclass

SECOND = 1_000_000_000


Stamp = tuple[int, int]  # builtin_interfaces/Time: whole seconds and the nanoseconds beyond them


@dataclass(frozen=True)
class SimTime:
    """Simulated time of a clock with `rate` ticks a second.

    A tick is rarely a whole number of nanoseconds (1/240 s is not), so it is written rounded down; `tick` undoes that
    exactly for every rate below 1 GHz.
    """

    rate: int

    def __post_init__(self) -> None:
        if not 1 <= self.rate < SECOND:
            raise ValueError(f"a clock of {self.rate} Hz cannot be told in nanoseconds")

    def nanoseconds(self, tick: int) -> int:
        """Nanoseconds since the start of the run."""
        return tick * SECOND // self.rate

    def stamp(self, tick: int) -> Stamp:
        """The same as a ROS time."""
        return divmod(tick * SECOND // self.rate, SECOND)

    def tick(self, nanoseconds: int) -> int:
        """The tick that `nanoseconds` was written for."""
        return -(-nanoseconds * self.rate // SECOND)
