"""Normally distributed numbers, drawn ahead: a draw of three costs as much as one of hundreds."""

import numpy as np

AT_ONCE = 384


class NormalStream:
    """Standard normal numbers of a stream that nobody else draws from: those that single draws would give."""

    def __init__(self, chance: np.random.Generator) -> None:
        self._chance = chance
        self._ahead: list[float] = []
        self._next = 0

    def take(self, count: int) -> list[float]:
        """The next `count` of them."""
        begin, end = self._next, self._next + count
        if end > len(self._ahead):
            self._ahead = self._ahead[begin:] + self._chance.standard_normal(max(count, AT_ONCE)).tolist()
            begin, end = 0, count
        self._next = end
        return self._ahead[begin:end]
