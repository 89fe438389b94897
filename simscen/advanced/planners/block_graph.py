"""Graph of the moves between square blocks of costmap cells, for shortest paths over a coarse grid.

Two blocks are connected if free cells touch across their border. A gap narrower than a block therefore stays open, and
a wall thinner than a block stays closed.
"""

import math

import numpy as np
from scipy.sparse import csr_matrix

from simscen.advanced.cell_blocks import pool_blocks
from simscen.core.geometry import Array
from simscen.stack.moving_obstacles import Mask
from simscen.stack.planners.traversal_costs import TraversalCosts


def block_graph(costs: TraversalCosts, factor: int, by_cost: bool) -> csr_matrix:
    """Return the graph of moves between blocks. Its weights are lengths in blocks, times the mean cost if `by_cost`."""
    blocks = _as_blocks(costs.free, factor)
    height, width = blocks.shape[:2]
    steps = _possible_moves(blocks)
    moves = sorted(steps, key=lambda move: move[0] * width + move[1])
    offsets = np.array([rows * width + columns for rows, columns in moves])
    lengths = np.array([math.hypot(*move) for move in moves])
    possible = np.stack([steps[move].reshape(-1) for move in moves], axis=1)
    from_block, move = possible.nonzero()  # in the row order of the matrix
    to_block = from_block + offsets[move]
    if by_cost:
        costs_per_meter = _block_costs(costs, factor)
        weights = (0.5 * lengths).astype(np.float32)[move] * (costs_per_meter[from_block] + costs_per_meter[to_block])
    else:
        weights = lengths[move]
    row_starts = np.concatenate(([0], possible.sum(axis=1).cumsum()))
    return csr_matrix((weights, to_block, row_starts), shape=(height * width, height * width))


def _as_blocks(free: Mask, factor: int) -> Mask:
    """Return cells as blocks (rows, columns, factor, factor). The last blocks are filled up with occupied cells."""
    height, width = (-(-side // factor) * factor for side in free.shape)
    padded = np.zeros((height, width), dtype=bool)
    padded[: free.shape[0], : free.shape[1]] = free
    return np.asarray(padded.reshape(height // factor, factor, width // factor, factor).transpose(0, 2, 1, 3))


def _possible_moves(blocks: Mask) -> dict[tuple[int, int], Mask]:
    """Return, for 8 of the 16 moves (rows, columns), the mask of blocks from which the move is possible.

    A move to an adjacent block is possible if free cells touch across the border. A diagonal move needs one of the two
    ways over adjacent blocks, a knight's move needs both of its ways. The other 8 moves are the reverse moves.
    """
    right, up = np.zeros(blocks.shape[:2], dtype=bool), np.zeros(blocks.shape[:2], dtype=bool)
    right[:, :-1] = (blocks[:, :-1, :, -1] & blocks[:, 1:, :, 0]).any(axis=2)
    up[:-1] = (blocks[:-1, :, -1] & blocks[1:, :, 0]).any(axis=2)
    left = _shifted(right, 0, -1)
    right_up = (right & _shifted(up, 0, 1)) | (up & _shifted(right, 1, 0))
    left_up = (left & _shifted(up, 0, -1)) | (up & _shifted(left, 1, 0))
    return {
        (0, 1): right,
        (1, 0): up,
        (1, 1): right_up,
        (1, -1): left_up,
        (1, 2): right & _shifted(right_up, 0, 1) & right_up & _shifted(right, 1, 1),
        (2, 1): up & _shifted(right_up, 1, 0) & right_up & _shifted(up, 1, 1),
        (1, -2): left & _shifted(left_up, 0, -1) & left_up & _shifted(left, 1, -1),
        (2, -1): up & _shifted(left_up, 1, 0) & left_up & _shifted(up, 1, -1),
    }


def _shifted(mask: Mask, rows: int, columns: int) -> Mask:
    """Return the mask shifted by `rows` and `columns`, with False beyond its edge."""
    moved = np.zeros_like(mask)
    height, width = mask.shape
    left = max(0, -columns)
    moved[: height - rows, left : width - max(0, columns)] = mask[rows:, left + columns : width + min(0, columns)]
    return moved


def _block_costs(costs: TraversalCosts, factor: int) -> Array:
    """Return the cost per m (blocks,) of each block: the mean of the cheapest cell and the average of free cells.

    The average alone would be too high for a block in a narrow gap, where the robot drives in the center.
    """
    finite = np.isfinite(costs.rates)
    minimum = pool_blocks(costs.rates, factor, np.minimum, np.inf)
    total = pool_blocks(np.where(finite, costs.rates, np.float32(0.0)), factor, np.add, 0.0)
    mean: Array = 0.5 * (minimum + total / np.maximum(pool_blocks(finite.astype(np.float32), factor, np.add, 0.0), 1.0))
    return mean.reshape(-1)
