"""A figure of a benchmark, and what it varied by."""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any


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


# MERGED: Where the time of a run goes: exclusive time for each part.
@dataclass
class Stopwatch:
    """Measures methods by wrapping them on their instances; what a part calls in another counts for the other.

    `seconds` by part, in the order in which the parts were named.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    _under_way: list[float] = field(default_factory=list)

    def watch(self, part: str, thing: object, *methods: str) -> None:
        """Count what these methods of `thing` take as `part`."""
        self.seconds.setdefault(part, 0.0)
        for name in methods:
            setattr(thing, name, self._timed(part, getattr(thing, name)))

    def _timed(self, part: str, method: Callable[..., Any]) -> Callable[..., Any]:
        seconds, under_way, now = self.seconds, self._under_way, time.perf_counter

        def timed(*args: Any, **kwargs: Any) -> Any:
            begun = now()
            under_way.append(0.0)
            try:
                return method(*args, **kwargs)
            finally:
                took = now() - begun
                seconds[part] += took - under_way.pop()
                if under_way:
                    under_way[-1] += took

        return timed
