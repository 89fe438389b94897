"""Buffered standard normal random numbers: drawing three at a time would cost as much as drawing hundreds."""

import numpy as np

BUFFER_SIZE = 384


class NormalStream:
    """Standard normal numbers from a generator with no other user, the same as single draws would give."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._buffer: list[float] = []
        self._next = 0

    def take(self, count: int) -> list[float]:
        """Return the next `count` numbers."""
        begin, end = self._next, self._next + count
        if end > len(self._buffer):
            self._buffer = self._buffer[begin:] + self._rng.standard_normal(max(count, BUFFER_SIZE)).tolist()
            begin, end = 0, count
        self._next = end
        return self._buffer[begin:end]
