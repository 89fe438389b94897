"""Temporal operators against brute force over every window."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_formulas import NUMBERS, VALUES

from simscen.criteria.stl import operators
from simscen.criteria.stl.operators import Continuation, SampleWindow


def brute(operator, values, window, ahead, others=None):
    """By definition, over each pair of samples."""
    n = len(values)
    answers = []
    for t in range(n):
        first = t + window.first
        closes = window.last is None and ahead.over
        last = n - 1 if closes else max(n, first) + 1 if window.last is None else t + window.last

        def at(signal, k):
            return signal[k] if k < n else ahead.beyond

        if first > last:
            held = min((at(values, i) for i in range(t, first)), default=math.inf)
            answers.append(min(held, ahead.beyond) if operator == "until" else ahead.beyond)
            continue
        reach = range(first, last + 1)
        if operator == "always":
            answers.append(min(at(values, k) for k in reach))
        elif operator == "eventually":
            answers.append(max(at(values, k) for k in reach))
        else:
            holds = [min((at(values, i) for i in range(t, k)), default=math.inf) for k in reach]
            answers.append(max(min(at(others, k), held) for k, held in zip(reach, holds, strict=True)))
    return answers


@settings(deadline=None)
@given(
    VALUES,
    st.integers(0, 15),
    st.none() | st.integers(0, 15),
    st.sampled_from([-math.inf, math.inf]),
    st.booleans(),
    st.data(),
)
def test_every_operator_is_what_brute_force_over_all_windows_says(values, first, length, beyond, over, data):
    others = data.draw(st.lists(NUMBERS, min_size=len(values), max_size=len(values)))
    window, ahead = SampleWindow(first, None if length is None else first + length), Continuation(beyond, over)
    p, q = np.array(values), np.array(others)
    assert operators.always(p, window, ahead).tolist() == brute("always", values, window, ahead)
    assert operators.eventually(p, window, ahead).tolist() == brute("eventually", values, window, ahead)
    assert operators.until(p, q, window, ahead).tolist() == brute("until", values, window, ahead, others)


def test_until_over_a_whole_minute_takes_no_cubic_time():
    """rtamt 0.4.10 takes 106 s for this; by definition it is 1201 samples and as many windows."""
    chance = np.random.default_rng(3)
    p, q = chance.normal(1.0, 1.0, 1201), chance.normal(-2.0, 1.0, 1201)
    whole = operators.until(p, q, SampleWindow(0, 1200), Continuation(-math.inf, True))
    assert whole[0] == max(min(q[k], p[:k].min(initial=math.inf)) for k in range(1201))


FEW = [list(values) for n in (1, 2, 3) for values in product((-1.0, 2.0), repeat=n)]
WINDOWS = [SampleWindow(first, last) for first in range(4) for last in (None, *range(first, 5))]


@pytest.mark.parametrize("seed", range(20))
def test_windows_reach_over_the_blocks_they_are_computed_in(seed):
    chance, ahead = np.random.default_rng(seed), Continuation(math.inf, True)
    values = chance.integers(-9, 9, 11).astype(np.float64)
    for window in (SampleWindow(first, first + length) for first in range(3) for length in range(7)):
        assert operators.always(values, window, ahead).tolist() == brute("always", values.tolist(), window, ahead)
        assert operators.eventually(values, window, ahead).tolist() == brute(
            "eventually", values.tolist(), window, ahead
        )


@pytest.mark.parametrize("over", [True, False])
@pytest.mark.parametrize("beyond", [-math.inf, math.inf])
def test_every_operator_in_every_window_over_every_short_signal(beyond, over):
    ahead = Continuation(beyond, over)
    for window, p in product(WINDOWS, FEW):
        values = np.array(p)
        assert operators.always(values, window, ahead).tolist() == brute("always", p, window, ahead)
        assert operators.eventually(values, window, ahead).tolist() == brute("eventually", p, window, ahead)
        for q in FEW:
            if len(q) == len(p):
                found = operators.until(values, np.array(q), window, ahead)
                assert found.tolist() == brute("until", p, window, ahead, q), (window, p, q)
