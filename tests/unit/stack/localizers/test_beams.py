"""Tests of the selection of the beams that a particle filter uses."""

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.stack.localizers.beams import select_beams
from simscen.testing.synthetic_room import scan

inf, nan = np.inf, np.nan


@pytest.mark.parametrize("beams", [1, 2, 59, 60, 61, 360, 719, 720])
def test_number_of_used_beams_is_between_half_and_the_whole_maximum(beams: int) -> None:
    count = len(select_beams(scan(np.full(beams, 2.0)), 60, -1, 100).ranges)
    assert min(beams, 30) <= count <= 60


def test_nan_is_ignored_and_ranges_without_a_hit_count_as_the_maximum_range() -> None:
    beams = select_beams(scan(np.array([nan, inf, -inf, -1.0, 0.01, 3.0, 12.0, 15.0])), 60, -1, 100)
    assert beams.ranges.tolist() == [12, 12, 12, 12, 3, 12, 12]


def test_narrower_limits_of_lidar_and_filter_apply() -> None:
    beams = select_beams(scan(np.array([0.2, 0.4, 4.0, 6.0])), 60, 0.3, 5.0)
    assert beams.ranges.tolist() == [5, 0.4, 4, 5]
    assert beams.range_max == 5


def test_beam_ends_are_hit_points_in_the_base_frame() -> None:
    lidar_scan = scan(np.array([1.0, inf, 2.5, nan, 0.7, 3.0]), mount=Pose2(0.2, -0.1, 0.8))
    assert np.allclose(select_beams(lidar_scan, 60, -1, 100).ends.view(np.float64).reshape(-1, 2), lidar_scan.points())


def test_scan_without_beams_has_no_beam_ends() -> None:
    beams = select_beams(scan(np.array([nan])), 60, -1, 100)
    assert beams.ends.shape == (0,)
