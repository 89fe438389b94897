"""Tests of SPARC and LDLJ against their definitions."""

import cmath
import itertools
import math

import numpy as np
import pytest

from simscen.criteria.trace_signals.sparc_ldlj import ldlj, sparc


def sparc_by_definition(speeds, rate):
    """Return SPARC as its authors do: up to 10 Hz, from the first to the last frequency with 5 % of the maximum."""
    count = 2 ** (math.ceil(math.log2(len(speeds))) + 4)
    turns = [-2j * math.pi * k / count for k in range(count // 2 + 1)]
    heights = [abs(sum(v * cmath.exp(turn * n) for n, v in enumerate(speeds))) for turn in turns]
    spectrum = [(k * rate / count, height / max(heights)) for k, height in enumerate(heights) if k * rate / count <= 10]
    loud = [k for k, (_, height) in enumerate(spectrum) if height > 0.05 - 1e-12]
    band = spectrum[loud[0] : loud[-1] + 1]
    width = band[-1][0] - band[0][0]
    return -sum(math.hypot((f - e) / width, h - g) for (e, g), (f, h) in itertools.pairwise(band))


TIMES = np.arange(65) / 40
PROFILES = {
    "a bell": np.exp(-20 * (TIMES - 0.8) ** 2),
    "a wobble within the band": 0.5 + 0.3 * np.sin(2 * math.pi * 7 * TIMES),
    "a wobble on its edge": 0.5 + 0.3 * np.sin(2 * math.pi * 10 * TIMES),
    "a wobble beyond it": 0.5 + 0.3 * np.sin(2 * math.pi * 11.5 * TIMES),
    "to and fro": np.sin(2 * math.pi * 5 * TIMES),
    "noise": np.random.default_rng(1).uniform(0, 1, 65),
    "three samples": np.array([0.0, 1.0, 0.5]),
    "two samples": np.array([1.0, 0.5]),
}


@pytest.mark.parametrize("rate", [5.0, 40.0, 100.0])
@pytest.mark.parametrize("profile", PROFILES)
def test_sparc_is_the_arc_length_of_the_spectrum(profile, rate):
    assert sparc(PROFILES[profile], rate) == pytest.approx(sparc_by_definition(PROFILES[profile].tolist(), rate))


def test_frequency_at_five_percent_of_the_peak_belongs_to_the_arc():
    """At half the rate, where 10.5 - 9.5 is 5 % of 10.5 + 9.5."""
    assert sparc(np.array([10.5, 9.5]), 20.0) == pytest.approx(sparc_by_definition([10.5, 9.5], 20.0), rel=1e-12)


def test_sparc_needs_two_frequencies_below_the_cutoff_and_two_samples():
    assert sparc(np.array([1.0, 1.0]), 200.0) == pytest.approx(sparc_by_definition([1.0, 1.0], 200.0))
    assert sparc(np.array([1.0, 1.0]), 1000.0) is None
    assert sparc(np.array([1.0]), 40.0) is None


@pytest.mark.parametrize("speeds", [[], [0.0], [0.0, 0.0], [0.0, 0.0, 0.0]])
def test_smoothness_of_a_stationary_robot_is_undefined(speeds):
    assert (sparc(np.array(speeds), 40.0), ldlj(np.array(speeds), 40.0)) == (None, None)


@pytest.mark.parametrize("rate", [1.0, 2.0, 40.0])
def test_ldlj_has_no_unit(rate):
    """3^3 / 1^2 * 2^2 of a peak over three samples, however long they are and however high it is."""
    assert ldlj(np.array([0.0, 1.0, 0.0]), rate) == pytest.approx(-math.log(108))
    assert ldlj(np.array([0.0, -5.0, 0.0]), rate) == pytest.approx(-math.log(108))
    assert ldlj(np.array([0.0, 1.0, 1.0, 0.0]), rate) == pytest.approx(-math.log(4**3 * 2))


def test_the_ldlj_of_a_slope_that_hardly_changes_is_above_zero():
    assert ldlj(np.array([1.0, 0.998046875, 1.0]), 40.0) == pytest.approx(-math.log(27 * 2**-16))


@pytest.mark.parametrize("speeds", [[1.0], [1.0, 2.0], [1.0, 2.0, 3.0]])
def test_ldlj_without_jerk_is_undefined(speeds):
    assert ldlj(np.array(speeds), 40.0) is None
