"""Covering arrays, against enumeration of all rows."""

import random
from itertools import combinations, product

import pytest

from simscen.loading.variations.covering_arrays import Row, covering_array, pairs_of


@pytest.mark.parametrize(
    ("counts", "most"),
    [([2, 2, 2, 2], 6), ([3] * 4, 12), ([3] * 13, 22), ([5, 4, 3, 2, 2, 2], 24), ([7], 7), ([4, 9], 36)],
)
def test_all_pairs_are_covered_in_few_rows(counts: list[int], most: int) -> None:
    rows = covering_array(counts, lambda _: True)
    pairs = {
        (a, x, b, y)
        for a, b in combinations(range(len(counts)), 2)
        for x, y in product(range(counts[a]), range(counts[b]))
    }
    assert set().union(*map(pairs_of, rows)) == pairs
    assert len(set(rows)) == len(rows) <= most
    assert rows == covering_array(counts, lambda _: True)


@pytest.mark.parametrize("seed", range(20))
def test_exactly_the_possible_pairs_are_covered_if_rows_are_forbidden(seed: int) -> None:
    rng = random.Random(seed)
    counts = [rng.randint(1, 4) for _ in range(rng.randint(2, 5))]
    allowed = {row for row in product(*map(range, counts)) if rng.random() < rng.choice((0.1, 0.5, 0.9))}

    def is_allowed(row: Row) -> bool:
        return row in allowed

    rows = covering_array(counts, is_allowed)
    assert set(rows) <= allowed
    assert set().union(*map(pairs_of, rows)) == set().union(*map(pairs_of, allowed))
