"""Normally distributed numbers, drawn ahead: a draw of three costs as much as one of hundreds."""

import numpy as np

AT_ONCE = 384


class Normals:
    """Standard normal numbers of a stream that nobody else draws from: those that single draws would give."""

    def __init__(self, chance: np.random.Generator) -> None:
        self._chance = chance
        self._ahead: list[float] = []
        self._next = 0

    def take(self, count: int) -> list[float]:
        """The next `count` of them."""
        if self._next + count > len(self._ahead):
            self._ahead = self._ahead[self._next :] + self._chance.standard_normal(max(count, AT_ONCE)).tolist()
            self._next = 0
        self._next += count
        return self._ahead[self._next - count : self._next]
