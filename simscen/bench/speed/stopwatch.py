"""Where the time of a run goes: exclusive time for each part."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


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
