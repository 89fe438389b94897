"""What is worked out, but not there yet."""

import math
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class LatencyQueue(Generic[T]):
    """Results that are there `latency` ticks after their work began, in the order in which it did.

    `due` is the tick at which the oldest of them is there: `while tick >= underway.due: underway.take()`.
    """

    def __init__(self, latency: int) -> None:
        self._latency = latency
        self._waiting: deque[tuple[int, T]] = deque()
        self.due: float = math.inf

    def put(self, tick: int, result: T) -> None:
        """Work on this begins at `tick`."""
        if not self._waiting:
            self.due = tick + self._latency
        self._waiting.append((tick + self._latency, result))

    def take(self) -> T:
        """The oldest of them."""
        _, oldest = self._waiting.popleft()
        self.due = self._waiting[0][0] if self._waiting else math.inf
        return oldest

    def busy(self, tick: int) -> bool:
        """Whether the work on anything goes on beyond this tick."""
        return bool(self._waiting) and self._waiting[-1][0] > tick

    def clear(self) -> None:
        """Nothing of it is wanted any more."""
        self._waiting.clear()
        self.due = math.inf
