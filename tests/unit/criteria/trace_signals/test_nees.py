"""Tests of NEES against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.trace import Samples
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.trace_signals.estimation_errors import DIMENSIONS, nees, nees_samples
from simscen.testing.synthetic_trace import synthetic_trace

VARIANCES = [0.25, 0.0, 0.0, 0.04, 0.0, 0.01]
"""Variances of x, y and yaw: deviations of 0.5 m, 0.2 m and 0.1 rad."""


def of(error, covariance):
    return float(nees(np.array([error]), np.array([covariance]))[0])


@pytest.mark.parametrize(("error", "expected"), [((1, 0, 0), 4.0), ((0, 0.4, 0), 4.0), ((0, 0, 0.3), 9.0)])
def test_nees_is_the_squared_error_in_standard_deviations(error, expected):
    assert of(error, VARIANCES) == pytest.approx(expected)
    assert of([-part for part in error], VARIANCES) == pytest.approx(expected)


def test_nees_is_weighted_by_the_inverse_covariance():
    rng = np.random.default_rng(4)
    roots, errors = rng.normal(size=(30, 3, 3)), rng.normal(size=(30, 3))
    full = roots @ roots.transpose(0, 2, 1) + 0.1 * np.eye(3)
    rows, columns = np.triu_indices(3)
    expected = [error @ np.linalg.inv(matrix) @ error for error, matrix in zip(errors, full, strict=True)]
    assert nees(errors, full[:, rows, columns]) == pytest.approx(expected)


@pytest.mark.parametrize(
    "covariance",
    [
        [0, 0, 0, 1, 0, 1],
        [1, 0, 0, 0, 0, 1],
        [1, 0, 0, 1, 0, 0],
        [-1, 0, 0, 1, 0, 1],
        [1, 0, 0, -1, 0, 1],
        [1, 0, 0, 1, 0, -1],
        [-1, 0, 0, -1, 0, -1],
        [1, 1, 0, 1, 0, 1],
        [1, 0, 1, 1, 0, 1],
        [1, 0, 0, 1, 1, 1],
        [1e-320, 0, 0, 1, 0, 1],
    ],
)
def test_nees_of_a_singular_covariance_is_infinite(covariance):
    assert of((1, 1, 1), covariance) == math.inf


def test_mean_nees_of_a_consistent_filter_is_its_dimension():
    assert DIMENSIONS == 3


def trace_of(truth, belief, covariance=VARIANCES):
    """Return a trace with truth and beliefs (tick, x, y, yaw)."""
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    ticks, poses = np.array([row[0] for row in belief]), np.array([row[1:] for row in belief], dtype=np.float64)
    way = Samples(np.array([row[0] for row in truth]), np.array([row[1:] for row in truth], dtype=np.float64))
    return replace(
        trace, truth=way, belief=Samples(ticks, np.column_stack((poses, np.tile(covariance, (len(ticks), 1)))))
    )


def test_each_belief_is_compared_with_the_truth_at_its_tick():
    trace = trace_of([(0, 0, 0, 0), (240, 4, 8, 0.4)], [(60, 1, 2, 0.1), (120, 3, 4, 0.2), (180, 3, 6.4, 0.2)])
    found = nees_samples(trace)
    assert found.ticks.tolist() == [60, 120, 180]
    assert found.values == pytest.approx(np.array([[0.0], [4.0], [5.0]]))


def test_heading_difference_is_wrapped():
    trace = trace_of([(0, 0, 0, 3.1), (240, 0, 0, 3.2 - 2 * math.pi)], [(120, 0, 0, 3.05 - 2 * math.pi)])
    assert nees_samples(trace).values[0, 0] == pytest.approx(1.0)


def test_each_belief_uses_its_own_covariance():
    trace = trace_of([(0, 0, 0, 0)], [(0, 1, 0.2, 0.1)], [0.25, 0.03, 0.01, 0.04, 0.002, 0.01])
    full = np.array([[0.25, 0.03, 0.01], [0.03, 0.04, 0.002], [0.01, 0.002, 0.01]])
    error = np.array([1, 0.2, 0.1])
    assert nees_samples(trace).values[0, 0] == pytest.approx(error @ np.linalg.inv(full) @ error)


def test_nees_is_undefined_without_covariances_beliefs_or_truth():
    trace = trace_of([(0, 0, 0, 0)], [(0, 0, 0, 0)])
    nothing = Samples(np.empty(0, dtype=np.int64), np.empty((0, 9)))
    bare = Samples(trace.belief.ticks, trace.belief.values[:, :8])
    for lacking in (replace(trace, belief=bare), replace(trace, belief=nothing), replace(trace, truth=nothing)):
        assert nees_samples(lacking).values.shape == (0, 1)
        assert len(nees_samples(lacking)) == 0
    assert len(nees_samples(trace)) == 1


def test_nonfinite_belief_is_reported():
    with pytest.raises(InvalidTrace, match=r"the belief is not finite at t = 0.50 s"):
        nees_samples(trace_of([(0, 0, 0, 0)], [(0, 0, 0, 0), (120, math.nan, 0, 0)]))
