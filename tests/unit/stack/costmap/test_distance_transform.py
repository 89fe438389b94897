"""Tests of the distance transform against SciPy."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from simscen.stack.costmap import distance_transform
from simscen.stack.costmap.distance_transform import squared_distance_blocks, squared_distances_within


@pytest.mark.parametrize("shape", [(1, 1), (64, 7), (130, 50)])
def test_distances_in_blocks_match_scipy(shape):
    marked = np.random.default_rng(4).random(shape) < 0.02
    marked[0, 0] = True
    distances = np.full(shape, -1.0)
    for rows, squared in squared_distance_blocks(marked):
        distances[rows] = np.sqrt(squared)
    assert np.array_equal(distances, distance_transform_edt(~marked))


@pytest.mark.parametrize("block_size", [1, 1000, distance_transform.BLOCK_SIZE])
@pytest.mark.parametrize(
    ("shape", "reach"),
    [((1, 1), 3), ((64, 7), 9), ((7, 64), 80), ((150, 90), 4), ((3, 200), distance_transform.MAX_REACH_CELLS)],
)
def test_limited_distances_match_scipy_for_each_block_size(shape, reach, block_size, monkeypatch):
    monkeypatch.setattr(distance_transform, "BLOCK_SIZE", block_size)
    marked = np.random.default_rng(5).random(shape) < 0.01
    marked[-1, -1] = True
    squared = np.rint(distance_transform_edt(~marked) ** 2)
    assert np.array_equal(squared_distances_within(marked, reach), np.where(squared <= reach**2, squared, reach**2 + 1))


def test_distances_without_marked_cells_are_at_the_limit():
    assert (
        squared_distances_within(np.zeros((70, 5), dtype=bool), distance_transform.MAX_REACH_CELLS)
        == distance_transform.MAX_REACH_CELLS**2 + 1
    ).all()
