"""Tests of delta debugging with random causes of failure."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.cli.session.shrinking import failure_of, minimize
from simscen.core.errors import Exit, RunError
from simscen.core.records.run_result import RunFailure, RunKey, error_result


@given(st.sets(st.integers(0, 30)), st.integers(1, 31))
def test_exactly_the_needed_parts_are_kept(needed: set[int], count: int) -> None:
    needed = {part for part in needed if part < count}
    tried: list[frozenset[int]] = []

    def first_failing(candidates: Sequence[Sequence[int]]) -> int | None:
        for index, candidate in enumerate(candidates):
            tried.append(frozenset(candidate))
            if needed <= set(candidate):
                return index
        return None

    assert minimize(range(count), first_failing) == sorted(needed)
    assert len(set(tried)) <= 2 * count * count + 4  # the bound of Zeller and Hildebrandt is quadratic


@given(st.sets(st.frozensets(st.integers(0, 9), min_size=1, max_size=4), min_size=1, max_size=5))
def test_no_single_part_can_be_removed_from_the_result(causes: set[frozenset[int]]) -> None:
    def fails(parts: Sequence[int]) -> bool:
        return any(cause <= set(parts) for cause in causes)

    def first_failing(candidates: Sequence[Sequence[int]]) -> int | None:
        return next((index for index, candidate in enumerate(candidates) if fails(candidate)), None)

    if not fails(range(10)):
        return
    kept = minimize(range(10), first_failing)
    assert fails(kept)
    assert not any(fails([part for part in kept if part != removed]) for removed in kept)


def test_an_aborted_run_is_no_failure_to_shrink_unless_the_stack_aborted_it() -> None:
    aborted = error_result(RunKey("a", 1), "a.scenario.yaml", RunFailure("out-of-memory", "too many particles"))
    with pytest.raises(RunError, match="the run could not be completed: too many particles") as error:
        failure_of(aborted, "", 0.5)
    assert error.value.exit is Exit.INCOMPLETE
    by_stack = error_result(RunKey("a", 1), "a.scenario.yaml", RunFailure("stack-crashed", "gone", by_stack=True))
    assert failure_of(by_stack, "", 0.5).criterion == ""
