import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from simscen.stack.nearest import squared_cells


@pytest.mark.parametrize("shape", [(1, 1), (64, 7), (130, 50)])
def test_distances_by_rows_are_scipys(shape):
    marked = np.random.default_rng(4).random(shape) < 0.02
    marked[0, 0] = True
    whole = np.full(shape, -1.0)
    for rows, squared in squared_cells(marked):
        whole[rows] = np.sqrt(squared)
    assert np.array_equal(whole, distance_transform_edt(~marked))
