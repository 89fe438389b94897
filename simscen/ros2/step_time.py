"""Limit of the wall time for which the adapter waits for nodes in one step of the run."""

import math
import time
from typing import Callable, Dict, Iterable

from simscen.ros2.options import AdapterError

MAX_LISTED_NODES = 3
"""Maximum number of slow nodes that the error message lists."""


class StepTime:
    """Limits the total wall time of all waits in a step."""

    def __init__(self, spin_until: Callable[[Callable[[], bool], float], bool]) -> None:
        """`spin_until` handles events of the graph, as Graph.spin_until does."""
        self._spin_until = spin_until
        self._end, self._limit = math.inf, math.inf
        self._waited: Dict[str, float] = {}

    def begin(self, limit_s: float) -> None:
        """Begin a step with the maximum wall time `limit_s`."""
        self._end, self._limit, self._waited = time.monotonic() + limit_s, limit_s, {}

    @property
    def remaining(self) -> float:
        """Wall time in s that is left for the step; inf before the first step."""
        return max(0.0, self._end - time.monotonic())

    def wait_for(self, late_nodes: Callable[[], Iterable[str]], limit_s: float) -> bool:
        """Handle events until `late_nodes` returns no nodes. Return False if that takes longer than `limit_s`.

        `late_nodes` returns the full names of the nodes that have not answered. Raises AdapterError with the slowest
        nodes if the time of the step is over.
        """
        start = time.monotonic()
        waiting = set(late_nodes())

        def is_done() -> bool:
            late = set(late_nodes())
            self._count(waiting - late, start)
            waiting.intersection_update(late)
            return not late

        if self._spin_until(is_done, min(limit_s, self.remaining)):
            return True
        self._count(waiting, start)
        if self.remaining:
            return False
        slowest = sorted(self._waited, key=lambda node: (-self._waited[node], node))[:MAX_LISTED_NODES]
        times = ", ".join(f"{node} ({self._waited[node]:.1f} s)" for node in slowest)
        raise AdapterError(
            f"a step took more than {self._limit:.3g} s of wall time, because these nodes answered late: {times}; "
            "if they need that long, increase `answer_limit` of the stack in your configuration"
        )

    def _count(self, nodes: Iterable[str], start: float) -> None:
        """Add the wall time since `start` to the waiting times of these nodes."""
        for node in nodes:
            self._waited[node] = self._waited.get(node, 0.0) + time.monotonic() - start
