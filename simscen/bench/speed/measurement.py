"""Data class for a measured figure of a benchmark, and a stopwatch for the parts of a run."""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Measurement:
    """Measured `value` in `unit` ("" for a ratio or count). If it was measured repeatedly, the median of `rounds`."""

    value: float
    unit: str
    rounds: tuple[float, ...] = ()
    more_is_better: bool = False

    @classmethod
    def of(cls, rounds: Sequence[float], unit: str, *, more_is_better: bool = False) -> "Measurement":
        """Return the measurement whose value is the median of the rounds."""
        return cls(statistics.median(rounds), unit, tuple(rounds), more_is_better)


Measurements = dict[str, Measurement]
"""Measurements by name, in the order in which they are printed."""


@dataclass
class Stopwatch:
    """Measures the wall time of the parts of a run by replacing methods of instances with wrappers.

    If a watched method calls another one, the time of the inner call counts for the inner part only. `seconds` is the
    wall time by part, in the order of the first `watch`.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    _nested_seconds: list[float] = field(default_factory=list)

    def watch(self, part: str, instance: object, *methods: str) -> None:
        """Add the wall time of these methods of `instance` to `part` from now on."""
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
