"""Tests of the searches for failures, with the test functions of `search_plants`."""

import math
import statistics
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import qmc
from search_plants import PLANTS, failure_threshold

from simscen.core.geometry import Array
from simscen.run.sessions.search import Search, SearchMethod, make_search


def runs_to_failure(search: Search, plant: Callable[[Array], Array], threshold: float, limit: int) -> int:
    """Return the number of runs until the first failure, at most `limit`."""
    runs = 0
    while runs < limit:
        points = search.ask(8)
        margins = [threshold - float(plant(np.array(point))) for point in points]
        failed = [number for number, margin in enumerate(margins, start=1) if margin < 0]
        if failed:
            return runs + failed[0]
        search.tell(margins)
        runs += 8
    return limit


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", PLANTS)
def test_tpe_finds_rare_failures_in_sixty_runs(name: str, is_quick: bool) -> None:
    plant = PLANTS[name]
    threshold = failure_threshold(plant)
    seeds = range(1, 9 if is_quick else 21)
    runs = [runs_to_failure(make_search(SearchMethod.TPE, [0] * 8, seed), plant, threshold, 400) for seed in seeds]
    assert statistics.median(runs) <= 60  # random values: a median of 173, by ln 0.5 / ln 0.996


@pytest.mark.parametrize("method", [SearchMethod.TPE, SearchMethod.SOBOL, SearchMethod.RANDOM])
def test_a_search_is_repeatable_and_stays_within_the_bounds(method: SearchMethod) -> None:
    def points() -> list[tuple[float, ...]]:
        search, found = make_search(method, [0, 3, 0], 7), []
        for _ in range(6):
            batch = search.ask(8)
            search.tell([math.nan, *(sum(point) for point in batch[1:])])
            found += batch
        return found

    first = points()
    assert first == points()
    assert all(0.0 < u < 1.0 for point in first for u in point)
    if method is SearchMethod.TPE:
        assert {round(point[1] * 3 - 0.5, 9) for point in first} == {0.0, 1.0, 2.0}


def test_sobol_points_are_more_even_than_random_ones() -> None:
    sobol, random = (
        np.array(make_search(method, [0, 0, 0], 1).ask(256)) for method in (SearchMethod.SOBOL, SearchMethod.RANDOM)
    )
    assert qmc.discrepancy(sobol) < qmc.discrepancy(random) / 5
