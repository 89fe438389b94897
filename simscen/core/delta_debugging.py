"""Delta debugging: the smallest set of parts that still has a property."""

from collections.abc import Callable, Sequence
from typing import TypeVar

Part = TypeVar("Part")
FirstFailing = Callable[[Sequence[Sequence[Part]]], int | None]
"""Returns the index of the first candidate that still has the property, None if there is none."""


def minimize(parts: Sequence[Part], first_failing: FirstFailing[Part]) -> list[Part]:
    """Return a subset of parts from which no single part can be removed, in their order.

    `first_failing` gets candidates, each a subset of the parts, in the order in which they are preferred. (Zeller and
    Hildebrandt: Simplifying and Isolating Failure-Inducing Input, 2002; with complements only.)
    """
    left = list(parts)
    if not left or first_failing([[]]) is not None:
        return []
    pieces = 2
    while len(left) > 1:
        size = -(-len(left) // pieces)
        starts = range(0, len(left), size)
        complements = [[*left[:start], *left[start + size :]] for start in starts]
        found = first_failing(complements)
        if found is not None:
            left, pieces = complements[found], max(2, pieces - 1)
        elif size == 1:
            break
        else:
            pieces = min(len(left), 2 * pieces)
    return left
