"""What is worked out, but not there yet."""

from collections import deque
from collections.abc import Sequence
from typing import Generic, TypeVar

T = TypeVar("T")


class Underway(Generic[T]):
    """Results that are there `latency` ticks after their work began, in the order in which it did."""

    def __init__(self, latency: int) -> None:
        self._latency = latency
        self._waiting: deque[tuple[int, T]] = deque()

    def put(self, tick: int, result: T) -> None:
        """Work on this begins at `tick`."""
        self._waiting.append((tick + self._latency, result))

    def take(self, tick: int) -> Sequence[T]:
        """What is there by now, oldest first."""
        if not self._waiting:
            return ()
        there: list[T] = []
        while self._waiting and self._waiting[0][0] <= tick:
            there.append(self._waiting.popleft()[1])
        return there

    def busy(self, tick: int) -> bool:
        """Whether the work on anything goes on beyond this tick."""
        return bool(self._waiting) and self._waiting[-1][0] > tick

    def clear(self) -> None:
        """Nothing of it is wanted any more."""
        self._waiting.clear()
