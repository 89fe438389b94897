"""A figure of a benchmark, and what it varied by."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Measurement:
    """A measured number: `value` in `unit`, and what each of the `rounds` gave that it is the median of, if several."""

    value: float
    unit: str
    rounds: tuple[float, ...] = ()
    more_is_better: bool = False

    @classmethod
    def of(cls, rounds: Sequence[float], unit: str, *, more_is_better: bool = False) -> "Measurement":
        """The median of several rounds."""
        return cls(statistics.median(rounds), unit, tuple(rounds), more_is_better)


Measurements = dict[str, Measurement]
"""By name, in the order in which they are shown."""
