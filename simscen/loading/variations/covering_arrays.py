"""Pairwise combinations of the values of several parameters (covering arrays)."""

import math
from collections.abc import Callable, Sequence
from itertools import combinations, product

Row = tuple[int, ...]
"""Combination of values: the index of the value of each parameter."""
Pair = tuple[int, int, int, int]
"""Pair of values of two parameters: (first parameter, index of value, second parameter, index of value)."""
CANDIDATES_PER_ROW = 30
"""Number of candidates for each row of a covering array. The candidate with the most new pairs is used."""
MAX_CHECKED_ROWS = 200_000
"""Maximum number of rows among which an allowed row with a given pair is searched."""


def covering_array(counts: Sequence[int], is_allowed: Callable[[Row], bool]) -> list[Row]:
    """Return a pairwise covering array: few allowed rows that contain each pair of values of two parameters.

    Pairs that no allowed row contains are left out. `counts` are the numbers of values of the parameters. `is_allowed`
    returns whether a row is allowed. The search is greedy and deterministic. (Cohen et al.: The AETG System, 1997.)
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
                for attempt in range(CANDIDATES_PER_ROW)
                if (row := _candidate_row(pair, counts, uncovered, attempt, is_allowed)) is not None
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


def pairs_of(row: Row) -> set[Pair]:
    """Return all pairs of values in a row."""
    return {(a, row[a], b, row[b]) for a, b in combinations(range(len(row)), 2)}


def _candidate_row(
    pair: Pair, counts: Sequence[int], uncovered: set[Pair], attempt: int, is_allowed: Callable[[Row], bool]
) -> Row | None:
    """Return a row with `pair` and, chosen greedily, many pairs of `uncovered`; None if the row is not allowed.

    `attempt` changes the order of the parameters and values.
    """
    a, x, b, y = pair
    chosen = {a: x, b: y}
    others = [parameter for parameter in range(len(counts)) if parameter not in chosen]
    if others:
        shift = attempt % len(others)
        others = others[shift:] + others[:shift]
    for parameter in others:
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


def _any_row_with(pair: Pair, counts: Sequence[int], is_allowed: Callable[[Row], bool]) -> Row | None:
    """Return the first allowed row that contains `pair`, among the first MAX_CHECKED_ROWS with the pair; else None."""
    a, x, b, y = pair
    fixed = {a: (x,), b: (y,)}
    choices = [fixed.get(parameter, range(count)) for parameter, count in enumerate(counts)]
    checked = min(MAX_CHECKED_ROWS, math.prod(len(values) for values in choices))
    rows = (row for row, _ in zip(product(*choices), range(checked), strict=False))
    return next((row for row in rows if is_allowed(row)), None)
