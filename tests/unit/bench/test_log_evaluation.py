"""Tests of the comparison of a localized drive with references that are dense, sparse, or have gaps."""

import numpy as np
import pytest

from simscen.bench.localization.log_evaluation import LocalizationResult, compare_with_reference
from simscen.record.localization_logs.read import LocalizationLog
from simscen.record.localization_logs.rows import TICK_RATE_HZ


def pose_errors(reference_times, offset=0.2):
    """Return the errors of beliefs `offset` m to the left of a robot at 1 m/s, against true poses at times in s."""
    times = np.arange(0.0, 60.0, 0.05)
    poses = np.column_stack([times, np.full(len(times), offset), np.zeros(len(times))])
    localized = LocalizationResult(times, poses, np.zeros((len(times), 3, 3)), 0, 0.0, 0.0)
    pose_times = np.asarray(reference_times, dtype=float)
    truth = np.column_stack([pose_times, np.zeros(len(pose_times)), np.zeros(len(pose_times))])
    recording = LocalizationLog((), np.round(pose_times * TICK_RATE_HZ).astype(int), truth)
    return compare_with_reference(localized, recording, 1.0)


def test_dense_reference_is_compared_at_all_beliefs():
    errors = pose_errors(np.arange(0.0, 60.5, 0.5))
    assert errors.compared_fraction == 1.0
    assert errors.distance == pytest.approx(0.2)


def test_a_sparse_reference_is_compared_at_its_own_times():
    errors = pose_errors(np.arange(0.0, 61.0, 5.0))
    assert 12 / 1200 <= errors.compared_fraction <= 3 * 13 / 1200
    assert errors.distance == pytest.approx(0.2)
    assert set(np.round(errors.times / 5.0)) == set(range(13)), "each reference pose is compared"


def test_beliefs_in_a_gap_are_not_compared():
    errors = pose_errors(np.concatenate([np.arange(0.0, 20.0, 0.1), np.arange(40.0, 60.1, 0.1)]))
    assert errors.compared_fraction == pytest.approx(2 / 3, abs=0.01)
