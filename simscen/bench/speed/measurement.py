"""Measured value of a benchmark, and stopwatch for the parts of a run."""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Measurement:
    """Measured `value` in `unit`, which is "" for a ratio or count.

    `rounds` are the values of repeated measurements, of which `value` is the median; () for a single measurement.
    """

    value: float
    unit: str
    rounds: tuple[float, ...] = ()
    more_is_better: bool = False

    @classmethod
    def from_rounds(cls, rounds: Sequence[float], unit: str) -> "Measurement":
        """Return the measurement with the median of these rounds as its value."""
        return cls(statistics.median(rounds), unit, tuple(rounds))


Measurements = dict[str, Measurement]
"""Measurements by name, in the order in which they are printed."""


@dataclass
class Stopwatch:
    """Stopwatch for methods. `seconds` is the wall time by part of a run, in the order of the calls of `watch`.

    If a watched method calls another watched method, the time of the inner call counts for the inner part only.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    _nested_seconds: list[float] = field(default_factory=list)

    def watch(self, part: str, instance: object, *methods: str) -> None:
        """Replace these methods of `instance` by wrappers that add their wall time to `part`."""
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
