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

    Time in a nested part counts for the nested part only. `seconds` has the parts in the order of their first `watch`.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    _nested_seconds: list[float] = field(default_factory=list)

    def watch(self, part: str, instance: object, *methods: str) -> None:
        """Measure these methods of `instance` as `part`."""
        self.seconds.setdefault(part, 0.0)
        for name in methods:
            setattr(instance, name, self._timed(part, getattr(instance, name)))

    def _timed(self, part: str, method: Callable[..., Any]) -> Callable[..., Any]:
        seconds, nested, now = self.seconds, self._nested_seconds, time.perf_counter

        def timed(*args: Any, **kwargs: Any) -> Any:
            start = now()
            nested.append(0.0)
            try:
                return method(*args, **kwargs)
            finally:
                duration = now() - start
                seconds[part] += duration - nested.pop()
                if nested:
                    nested[-1] += duration

        return timed
