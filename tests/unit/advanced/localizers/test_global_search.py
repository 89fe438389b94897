"""Tests of the search for the robot's pose on the whole map."""

import numpy as np
import pytest

from simscen.advanced.localizers.global_search import (
    MAX_RESULTS,
    PASSED_SHARES,
    GlobalSearch,
    View,
    _highest,
    select_distinct,
)
from simscen.advanced.localizers.scan_memory import MEMORY_LENGTH_M, ScanMemory, endpoints_of
from simscen.core.geometry import Pose2
from simscen.testing.synthetic_room import BEAMS, cast, grid, scan

POSES = (Pose2(-2.5, -1.8, 0.6), Pose2(3.0, 1.8, -2.8), Pose2(-4.0, 2.9, 1.9))


def view_from(pose: Pose2) -> View:
    ranges = cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0]
    ends = endpoints_of(scan(ranges), 0.0, 100.0)
    return View(ends, np.concatenate([ends * passed_share for passed_share in PASSED_SHARES]))


@pytest.mark.parametrize("pose", POSES)
def test_best_match_is_the_true_pose(pose: Pose2) -> None:
    poses, fits = GlobalSearch(grid()).search(view_from(pose))
    error = pose.between(Pose2(*poses[0].tolist()))
    assert np.hypot(error.x, error.y) < 0.1
    assert abs(error.yaw) < 0.03
    assert fits[0] > fits[1] + 0.05
    assert len(poses) <= MAX_RESULTS
    assert (np.diff(fits) <= 0).all()


@pytest.mark.parametrize("pose", POSES)
def test_search_near_a_wrong_estimate_finds_the_pose(pose: Pose2) -> None:
    estimate = np.array(pose.compose(Pose2(0.4, -0.3, 0.2)))
    poses, fits = GlobalSearch(grid()).search_near(view_from(pose), estimate)
    error = pose.between(Pose2(*poses[0].tolist()))
    assert np.hypot(error.x, error.y) < 0.1
    assert abs(error.yaw) < 0.03
    assert fits[0] > GlobalSearch(grid()).score(estimate[np.newaxis], view_from(pose))[0] + 0.05


def test_equal_scans_give_bit_identical_poses() -> None:
    view = view_from(POSES[0])
    first, second = (GlobalSearch(grid()).search(view) for _ in range(2))
    assert np.array_equal(first[0], second[0])
    assert np.array_equal(first[1], second[1])


def test_empty_scans_find_no_pose() -> None:
    poses, fits = GlobalSearch(grid()).search(View(np.empty(0, dtype=np.complex128), np.empty(0, dtype=np.complex128)))
    assert poses.shape == (0, 3)
    assert fits.shape == (0,)


@pytest.mark.parametrize("count", [1, 3, 4, 6, 9])
def test_highest_scores_are_chosen_and_the_first_of_equal_scores(count: int) -> None:
    scores = np.array([2, 5, 3, 3, 9, 3], dtype=np.uint16)
    by_score = sorted(range(6), key=lambda index: (-int(scores[index]), index))
    assert _highest(scores, count).tolist() == sorted(by_score[:count])


def test_nearby_matches_are_merged() -> None:
    poses = np.array([[0, 0, 0.0], [0.3, 0, 0.1], [0.3, 0, 1.0], [2, 0, 0], [0.1, 0, 2 * np.pi - 0.05]])
    kept, scores = select_distinct(poses, np.array([0.5, 0.9, 0.1, 0.2, 0.6]), 10)
    assert kept[:, 0].tolist() == [0.3, 2.0, 0.3]
    assert scores.tolist() == [0.9, 0.2, 0.1]


def test_scan_memory_contains_the_last_meters() -> None:
    memory, view = ScanMemory(), view_from(POSES[0])
    for meter in np.arange(0.0, 20.0, 0.5):
        memory.add(scan(np.full(8, 2.0)), Pose2(float(meter), 0.0, 0.0), 0.0, 100.0)
    assert memory.length <= MEMORY_LENGTH_M
    recent_view = memory.view_from(Pose2(19.5, 0.0, 0.0))
    assert recent_view.ends.real.min() == pytest.approx(-2.0 - memory.length)
    assert len(view.passed) == 3 * len(view.ends)
    memory.forget(1)
    assert memory.length == 0
    assert len(memory.view_from(Pose2(0, 0, 0)).ends) == 8
