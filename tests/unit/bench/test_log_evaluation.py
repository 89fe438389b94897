"""PoseErrors of a recorded drive against references that are dense, sparse, or have gaps."""

import numpy as np
import pytest

from simscen.bench.localization.log_evaluation import LocalizationResult, compare_with_reference
from simscen.record.localization_logs.read import LocalizationLog
from simscen.record.localization_logs.rows import TICK_RATE_HZ


def errors(reference_times, offset=0.2):
    """PoseErrors of a belief that is `offset` to the left of a robot at 1 m/s for 60 s, against poses at some times."""
    times = np.arange(0.0, 60.0, 0.05)
    poses = np.column_stack([times, np.full(len(times), offset), np.zeros(len(times))])
    localized = LocalizationResult(times, poses, np.zeros((len(times), 3, 3)), 0, 0.0, 0.0)
    known = np.asarray(reference_times, dtype=float)
    truth = np.column_stack([known, np.zeros(len(known)), np.zeros(len(known))])
    recording = LocalizationLog((), np.round(known * TICK_RATE_HZ).astype(int), truth)
    return compare_with_reference(localized, recording, 1.0)


def test_dense_reference_is_compared_at_all_beliefs():
    found = errors(np.arange(0.0, 60.5, 0.5))
    assert found.compared_fraction == 1.0
    assert found.distance == pytest.approx(0.2)


def test_a_sparse_reference_is_compared_at_its_own_times():
    found = errors(np.arange(0.0, 61.0, 5.0))
    assert 12 / 1200 <= found.compared_fraction <= 3 * 13 / 1200
    assert found.distance == pytest.approx(0.2)
    assert set(np.round(found.times / 5.0)) == set(range(13)), "each of its poses"


def test_beliefs_in_a_gap_are_not_compared():
    found = errors(np.concatenate([np.arange(0.0, 20.0, 0.1), np.arange(40.0, 60.1, 0.1)]))
    assert found.compared_fraction == pytest.approx(2 / 3, abs=0.01)
