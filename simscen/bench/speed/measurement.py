"""Measured figures of a benchmark, and a stopwatch for the parts of a run."""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Measurement:
    """Measured `value` in `unit`: the median of `rounds`, if there were several."""

    value: float
    unit: str
    rounds: tuple[float, ...] = ()
    more_is_better: bool = False

    @classmethod
    def of(cls, rounds: Sequence[float], unit: str, *, more_is_better: bool = False) -> "Measurement":
        """Return the median of several rounds."""
        return cls(statistics.median(rounds), unit, tuple(rounds), more_is_better)


Measurements = dict[str, Measurement]
"""Figures by name, in the printed order."""


@dataclass
class Stopwatch:
    """Measures the wall time of methods by wrapping them on their instances.

    Time in a nested part counts only for this part. `seconds` has the parts in the order of their first `watch`.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    _under_way: list[float] = field(default_factory=list)

    def watch(self, part: str, thing: object, *methods: str) -> None:
        """Measure these methods of `thing` as `part`."""
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
