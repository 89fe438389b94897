"""Queue of results that become available after a computation time."""

import math
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class LatencyQueue(Generic[T]):
    """First-in, first-out queue of results. A result is available `latency` ticks after its computation has started.

    `due` is the tick at which the oldest result becomes available, inf without results. To take all available results:
    `while tick >= queue.due: queue.take()`.
    """

    def __init__(self, latency: int) -> None:
        """Create an empty queue. `latency` is in ticks."""
        self._latency = latency
        self._waiting: deque[tuple[int, T]] = deque()
        self.due: float = math.inf

    def put(self, tick: int, result: T) -> None:
        """Add a result whose computation starts at `tick`."""
        if not self._waiting:
            self.due = tick + self._latency
        self._waiting.append((tick + self._latency, result))

    def take(self) -> T:
        """Remove and return the oldest result."""
        _, oldest = self._waiting.popleft()
        self.due = self._waiting[0][0] if self._waiting else math.inf
        return oldest

    def is_busy(self, tick: int) -> bool:
        """Return whether any computation still runs at this tick."""
        return bool(self._waiting) and self._waiting[-1][0] > tick

    def clear(self) -> None:
        """Discard all results."""
        self._waiting.clear()
        self.due = math.inf
