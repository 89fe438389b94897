"""Tests of the split of coarse maps into smaller cells."""

import numpy as np
import pytest

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2


@pytest.mark.parametrize(
    ("cell_size", "max_cell_size", "expected"),
    [(0.2, 0.05, 0.05), (0.18, 0.05, 0.045), (0.02, 0.05, 0.02), (0.4, 0.2, 0.2)],
)
def test_coarse_map_is_split_into_equal_cells(cell_size, max_cell_size, expected):
    rng = np.random.default_rng(2)
    coarse = OccupancyGrid(rng.choice([0, 40, 100, -1], (12, 9)).astype(np.int8), cell_size, Pose2(1, 2, 0.3))
    fine = coarse.refined(max_cell_size)
    assert fine.resolution == pytest.approx(expected)
    points = coarse.origin.apply(rng.uniform((-0.5, -0.5), (9 * cell_size + 0.5, 12 * cell_size + 0.5), (2000, 2)))
    assert np.array_equal(fine.values_at(points), coarse.values_at(points))


def test_split_of_a_huge_coarse_map_is_limited():
    assert OccupancyGrid(np.zeros((2000, 3000), dtype=np.int8), 0.5).refined(0.05).shape == (2000, 3000)
    assert OccupancyGrid(np.zeros((1000, 1000), dtype=np.int8), 0.5).refined(0.05).resolution == 0.125
