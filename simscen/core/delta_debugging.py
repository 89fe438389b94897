"""Delta debugging: the smallest set of parts that still has a property."""

from collections.abc import Callable, Sequence
from typing import TypeVar

Part = TypeVar("Part")
FirstFailing = Callable[[Sequence[Sequence[Part]]], int | None]
"""Returns the index of the first candidate that still has the property, or None."""


def minimize(parts: Sequence[Part], first_failing: FirstFailing[Part]) -> list[Part]:
    """Return a subset of the parts that still has the property, but loses it if any single part is removed.

    `first_failing` gets candidates, each a subset of the parts in their original order; earlier candidates are
    preferred. (Zeller and Hildebrandt: Simplifying and Isolating Failure-Inducing Input, 2002; with complements only.)
    """
    remaining = list(parts)
    if not remaining or first_failing([[]]) is not None:
        return []
    chunks = 2
    while len(remaining) > 1:
        size = -(-len(remaining) // chunks)
        starts = range(0, len(remaining), size)
        complements = [[*remaining[:start], *remaining[start + size :]] for start in starts]
        index = first_failing(complements)
        if index is not None:
            remaining, chunks = complements[index], max(2, chunks - 1)
        elif size == 1:
            break
        else:
            chunks = min(len(remaining), 2 * chunks)
    return remaining
