"""Tests of the rectangular blocks of equal cells of a filter mask."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from simscen.core.environment.costmap_filters import mask_blocks
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2

CELLS = arrays(
    np.int8, array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=8), elements=st.sampled_from([-1, 0, 40, 100])
)


@given(CELLS)
def test_blocks_of_a_mask_contain_each_marked_cell_once(cells):
    mask = mask_blocks(OccupancyGrid(cells, 0.1, Pose2(1.0, 2.0, 0.3)))
    positive_cells = np.where(cells > 0, cells, 0)
    block_grid = mask.grid
    rows, columns = block_grid.shape
    padded = np.zeros_like(cells)
    padded[:rows, :columns] = block_grid.cells
    np.testing.assert_array_equal(padded, positive_cells)
    assert sum(width * height for _, _, width, height, _ in mask.blocks) == np.count_nonzero(positive_cells)
    assert (mask.resolution, mask.origin) == (0.1, Pose2(1.0, 2.0, 0.3))


@given(CELLS)
def test_occupied_mask_cells_are_forbidden(cells):
    boxes = mask_blocks(OccupancyGrid(cells, 0.5)).occupied_boxes
    assert np.prod(boxes[:, 2:] - boxes[:, :2], axis=1).sum() == 0.25 * np.count_nonzero(cells == 100)


def test_equal_cells_are_one_block():
    cells = np.zeros((50, 60), dtype=np.int8)
    cells[10:40, 20:50] = 100
    assert mask_blocks(OccupancyGrid(cells, 0.1)).blocks == ((20, 10, 30, 30, 100),)
