"""Pairwise covering arrays: few rows in which each pair of values of two parameters occurs."""

import math
from collections.abc import Callable, Sequence
from itertools import combinations, product

Row = tuple[int, ...]
"""Index of the value of each parameter."""
CANDIDATES = 30
"""Rows that are tried for each row of the array; the row with the most new pairs is used."""
MAX_CHECKED_ROWS = 200_000
"""Limit of the search for a row that contains a given pair and is allowed."""


def covering_array(counts: Sequence[int], is_allowed: Callable[[Row], bool]) -> list[Row]:
    """Return rows that contain each possible pair of values, and only rows that are allowed.

    `counts` are the numbers of values of the parameters. A pair is possible if an allowed row contains it. Greedy and
    deterministic. (Cohen et al.: The AETG System, 1997.)
    """
    if len(counts) == 1:
        return [(value,) for value in range(counts[0]) if is_allowed((value,))]
    uncovered = {
        (a, x, b, y)
        for a, b in combinations(range(len(counts)), 2)
        for x, y in product(range(counts[a]), range(counts[b]))
    }
    rows: list[Row] = []
    for pair in sorted(uncovered):
        if pair not in uncovered:
            continue
        best = max(
            (
                row
                for attempt in range(CANDIDATES)
                if (row := _complete(pair, counts, uncovered, attempt, is_allowed)) is not None
            ),
            key=lambda row: len(pairs_of(row) & uncovered),
            default=None,
        )
        if best is None:
            best = _any_row_with(pair, counts, is_allowed)
        if best is None:
            uncovered.discard(pair)
        else:
            uncovered -= pairs_of(best)
            rows.append(best)
    return rows


def pairs_of(row: Row) -> set[tuple[int, int, int, int]]:
    """Return all pairs (parameter, value, parameter, value) of a row, the parameters in order."""
    return {(a, row[a], b, row[b]) for a, b in combinations(range(len(row)), 2)}


def _complete(
    pair: tuple[int, int, int, int],
    counts: Sequence[int],
    uncovered: set[tuple[int, int, int, int]],
    attempt: int,
    is_allowed: Callable[[Row], bool],
) -> Row | None:
    """Return a row with the pair whose other values are chosen greedily for most new pairs; None if not allowed.

    `attempt` changes the order of the parameters and of equally good values.
    """
    a, x, b, y = pair
    chosen = {a: x, b: y}
    rest = [parameter for parameter in range(len(counts)) if parameter not in chosen]
    if rest:
        shift = attempt % len(rest)
        rest = rest[shift:] + rest[:shift]
    for parameter in rest:
        values = [(value + attempt) % counts[parameter] for value in range(counts[parameter])]
        chosen[parameter] = max(
            values,
            key=lambda value: sum(
                (
                    (other, other_value, parameter, value)
                    if other < parameter
                    else (parameter, value, other, other_value)
                )
                in uncovered
                for other, other_value in chosen.items()
            ),
        )
    row = tuple(chosen[parameter] for parameter in range(len(counts)))
    return row if is_allowed(row) else None


def _any_row_with(
    pair: tuple[int, int, int, int], counts: Sequence[int], is_allowed: Callable[[Row], bool]
) -> Row | None:
    """Return the first allowed row that contains the pair, or None if there is none among MAX_CHECKED_ROWS rows."""
    a, x, b, y = pair
    fixed = {a: (x,), b: (y,)}
    choices = [fixed.get(parameter, range(count)) for parameter, count in enumerate(counts)]
    checked = min(MAX_CHECKED_ROWS, math.prod(len(values) for values in choices))
    rows = (row for row, _ in zip(product(*choices), range(checked), strict=False))
    return next((row for row in rows if is_allowed(row)), None)
