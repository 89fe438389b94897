"""Signals against closed forms, brute force and evo's definition of APE."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.criteria.signals import drive, first_lasting, pose_error
from simscen.judge.sketch import sketch


def test_a_circle_is_as_long_as_its_circumference():
    angles = np.linspace(0, 2 * math.pi, 400)
    circle = [[10 * k / 399, 2 * math.cos(a), 2 * math.sin(a), a + math.pi / 2] for k, a in enumerate(angles)]
    assert drive(sketch({"seconds": 10, "truth": circle})).length == pytest.approx(4 * math.pi, rel=1e-3)


def test_the_way_until_a_moment_grows_with_it():
    way = drive(sketch({"seconds": 10, "truth": [[0, 0, 0], [10, 8, 0]]}))
    assert way.until(0) == 0.0
    assert way.until(1200) == pytest.approx(4.0, abs=0.021)
    assert way.until(10**9) == way.length == pytest.approx(8.0)


def test_pose_error_is_the_distance_at_the_moment_of_the_belief():
    trace = sketch({"seconds": 10, "truth": [[0, 0, 0], [10, 5, 0]], "belief": {"offset": [0.03, 0.04, 0.1]}})
    error = pose_error(trace)
    assert error.values[:, 0] == pytest.approx(np.full(len(error), 0.05))
    assert error.values[:, 1] == pytest.approx(np.full(len(error), 0.1))


def test_a_belief_that_falls_silent_grows_wrong_after_a_second():
    trace = sketch({"seconds": 10, "truth": [[0, 0, 0], [10, 5, 0]]})
    early = trace.belief.ticks <= 2 * 240
    silent = type(trace)(
        **{**vars(trace), "belief": type(trace.belief)(trace.belief.ticks[early], trace.belief.values[early])}
    )
    error = pose_error(silent)
    assert error.values[error.ticks <= 480, 0].max() == pytest.approx(0.0, abs=1e-9)
    assert error.ticks[error.ticks > 480][0] == 480 + 240 + 6
    assert error.values[-1, 0] == pytest.approx(4.0)


@given(st.lists(st.booleans(), min_size=1, max_size=30), st.integers(0, 40))
def test_the_first_lasting_stretch_is_the_one_brute_force_finds(true, hold):
    ticks = np.arange(len(true), dtype=np.int64) * 3
    end = int(ticks[-1]) + 2
    expected = (None, False)
    for k in range(len(true)):
        if true[k] and (k == 0 or not true[k - 1]):
            stop = next((int(ticks[m]) for m in range(k, len(true)) if not true[m]), end)
            if stop - ticks[k] >= hold:
                expected = (int(ticks[k]), True)
                break
            if stop == end:
                expected = (int(ticks[k]), False)
    assert first_lasting(ticks, np.array(true), hold, end) == expected
