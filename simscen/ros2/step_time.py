"""Wall time of one step of the run: who is waited for, and an error with their names when the time is over."""

import math
import time
from typing import Callable, Dict, Iterable

from simscen.ros2.options import AdapterError

LISTED = 3
"""Number of nodes that the error names."""


class StepTime:
    """Limits all waiting in a step together. `spin_until` handles events until a condition holds."""

    def __init__(self, spin_until: Callable[[Callable[[], bool], float], bool]) -> None:
        self._spin_until = spin_until
        self._end, self._limit = math.inf, math.inf
        self._waited: Dict[str, float] = {}

    def begin(self, limit_s: float) -> None:
        """Begin a step, which may take `limit_s` of wall time."""
        self._end, self._limit, self._waited = time.monotonic() + limit_s, limit_s, {}

    @property
    def remaining(self) -> float:
        """Seconds of wall time that are left."""
        return max(0.0, self._end - time.monotonic())

    def wait_for(self, awaited: Callable[[], Iterable[str]], limit_s: float) -> bool:
        """Handle events until `awaited` names no more nodes; return False if that takes longer than `limit_s`.

        Raises AdapterError with the nodes that took longest when the time of the step is over.
        """
        start = time.monotonic()
        waiting = set(awaited())

        def is_done() -> bool:
            left = set(awaited())
            self._count(waiting - left, start)
            waiting.intersection_update(left)
            return not left

        if self._spin_until(is_done, min(limit_s, self.remaining)):
            return True
        self._count(waiting, start)
        if not self.remaining:
            raise AdapterError(self._message())
        return False

    def _count(self, nodes: Iterable[str], start: float) -> None:
        for node in nodes:
            self._waited[node] = self._waited.get(node, 0.0) + time.monotonic() - start

    def _message(self) -> str:
        slowest = sorted(self._waited, key=lambda node: (-self._waited[node], node))[:LISTED]
        times = ", ".join(f"{node} ({self._waited[node]:.1f} s)" for node in slowest)
        return (
            f"a step took more than {self._limit:.3g} s of wall time, because these nodes answered late: {times}; "
            "if they need that long, increase `answer_limit` of the stack in your configuration"
        )
