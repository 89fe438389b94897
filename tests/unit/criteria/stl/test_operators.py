"""Temporal operators against brute force over every window, on even and uneven samples."""

import math
from itertools import product
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_formulas import NUMBERS, VALUES

from simscen.criteria.stl import operators
from simscen.criteria.stl.operators import Continuation, SampleWindows


class SampleOffsets(NamedTuple):
    """A window from `first` to `last` samples ahead of each of evenly spaced samples; None is the end of the run."""

    first: int
    last: int | None

    def of(self, count):
        return SampleWindows.of_samples(np.arange(count), 1, self.first, self.last)


def brute(operator, values, window, continuation, others=None):
    """By definition, over each pair of samples."""
    n = len(values)
    answers = []
    for t in range(n):
        first = t + window.first
        closes = window.last is None and continuation.run_ended
        last = n - 1 if closes else max(n, first) + 1 if window.last is None else t + window.last

        def at(signal, k):
            return signal[k] if k < n else continuation.value_after_end

        if first > last:
            held = min((at(values, i) for i in range(t, first)), default=math.inf)
            answers.append(
                min(held, continuation.value_after_end) if operator == "until" else continuation.value_after_end
            )
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
def test_every_operator_equals_brute_force_over_all_windows(values, first, length, beyond, run_ended, data):
    others = data.draw(st.lists(NUMBERS, min_size=len(values), max_size=len(values)))
    window, continuation = (
        SampleOffsets(first, None if length is None else first + length),
        Continuation(beyond, run_ended),
    )
    p, q = np.array(values), np.array(others)
    assert operators.always(p, window.of(len(p)), continuation).tolist() == brute(
        "always", values, window, continuation
    )
    assert operators.eventually(p, window.of(len(p)), continuation).tolist() == brute(
        "eventually", values, window, continuation
    )
    assert operators.until(p, q, window.of(len(p)), continuation).tolist() == brute(
        "until", values, window, continuation, others
    )


def test_until_over_a_minute_does_not_take_cubic_time():
    """rtamt 0.4.10 takes 106 s for this; by definition it is 1201 samples and as many windows."""
    rng = np.random.default_rng(3)
    p, q = rng.normal(1.0, 1.0, 1201), rng.normal(-2.0, 1.0, 1201)
    whole = operators.until(p, q, SampleOffsets(0, 1200).of(1201), Continuation(-math.inf, True))
    assert whole[0] == max(min(q[k], p[:k].min(initial=math.inf)) for k in range(1201))


FEW = [list(values) for n in (1, 2, 3) for values in product((-1.0, 2.0), repeat=n)]
WINDOWS = [SampleOffsets(first, last) for first in range(4) for last in (None, *range(first, 5))]


@pytest.mark.parametrize("seed", range(20))
def test_windows_of_every_length_match_brute_force(seed):
    rng, continuation = np.random.default_rng(seed), Continuation(math.inf, True)
    values = rng.integers(-9, 9, 11).astype(np.float64)
    for window in (SampleOffsets(first, first + length) for first in range(3) for length in range(7)):
        assert operators.always(values, window.of(len(values)), continuation).tolist() == brute(
            "always", values.tolist(), window, continuation
        )
        assert operators.eventually(values, window.of(len(values)), continuation).tolist() == brute(
            "eventually", values.tolist(), window, continuation
        )


@pytest.mark.parametrize("run_ended", [True, False])
@pytest.mark.parametrize("beyond", [-math.inf, math.inf])
def test_every_operator_and_window_on_all_short_signals(beyond, run_ended):
    continuation = Continuation(beyond, run_ended)
    for window, p in product(WINDOWS, FEW):
        values = np.array(p)
        assert operators.always(values, window.of(len(values)), continuation).tolist() == brute(
            "always", p, window, continuation
        )
        assert operators.eventually(values, window.of(len(values)), continuation).tolist() == brute(
            "eventually", p, window, continuation
        )
        for q in FEW:
            if len(q) == len(p):
                found = operators.until(values, np.array(q), window.of(len(p)), continuation)
                assert found.tolist() == brute("until", p, window, continuation, q), (window, p, q)


STEPS = st.lists(st.integers(1, 5), min_size=0, max_size=9)


def in_window(ticks, k, begin, end):
    """The samples in the window of sample k by definition; the newest one before its end if there is none."""
    inside = [j for j, tick in enumerate(ticks) if ticks[k] + begin <= tick <= ticks[k] + end]
    if inside or ticks[k] + begin > ticks[-1]:
        return inside
    return [max(j for j, tick in enumerate(ticks) if tick <= ticks[k] + end)]


@settings(deadline=None)
@given(STEPS, st.integers(0, 8), st.integers(0, 8), st.sampled_from([-math.inf, math.inf]), st.data())
def test_windows_of_uneven_samples_are_selected_by_time(steps, begin, length, beyond, data):
    ticks = np.cumsum([0, *steps])
    p, q = (np.array(data.draw(st.lists(NUMBERS, min_size=len(ticks), max_size=len(ticks)))) for _ in "pq")
    period, end = data.draw(st.integers(1, 3)), begin + length
    window, continuation = SampleWindows.of_samples(ticks, period, begin, end), Continuation(beyond, run_ended=True)
    for k in range(len(ticks)):
        reach, open_end = in_window(ticks, k, begin, end), bool(ticks[k] + end >= ticks[-1] + period)
        values = [p[j] for j in reach] + [beyond] * (open_end or not reach)
        assert operators.eventually(p, window, continuation)[k] == max(values)
        assert operators.always(p, window, continuation)[k] == min(values)
        first = reach[0] if reach else len(ticks)
        held = [min([math.inf, *p[k:j]]) for j in range(len(ticks) + 1)]
        after = [min(held[j], q[j]) for j in reach if j >= first]
        after += [min(held[len(ticks)], beyond)] * (open_end or not reach)
        assert operators.until(p, q, window, continuation)[k] == max(after)
