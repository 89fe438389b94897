"""Tests of the cost of motions through a costmap."""

import math

import numpy as np
import pytest

from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView
from simscen.testing.flatland import round_robot


def sampled_cost(costs: TraversalCosts, start: np.ndarray, end: np.ndarray) -> float:
    """Return the length of a motion, multiplied by the mean cost of samples at its evenly spaced midpoints."""
    length = math.dist(start, end)
    fractions = (np.arange(int(length / costs.stride) + 1) + 0.5) / (int(length / costs.stride) + 1)
    samples = costs.at(np.vstack((start + fractions[:, None] * (end - start), (start + end) / 2)))
    return length * float(samples[:-1].mean()) if np.isfinite(samples).all() else math.inf


@pytest.mark.parametrize("seed", range(4))
def test_cost_of_a_motion_is_its_length_times_the_mean_cost_of_its_samples(seed: int) -> None:
    """Most motions cross only free cells; some cross or touch expensive or blocked cells."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((60, 90), dtype=np.uint8)
    for row, column in rng.integers(0, (56, 86), (8, 2)).tolist():
        cells[row : row + 4, column : column + 4] = rng.integers(40, 253)
    distance = np.ones(cells.shape, dtype=np.float32)
    distance[20:24, 30:34] = 0.0
    distance[35:55, 10:60] = round_robot().inscribed_radius + 0.03  # a narrow gap
    view = CostmapView(cells, distance, 0.05, (-1.0, 2.0))
    with_gaps = TraversalCosts(view, round_robot(), 2.0, True)
    with_gaps.between(0.0, 2.2, 0.1, 2.2)
    for costs in (with_gaps, with_gaps.without_narrow_gaps(0.05, ())):
        results = []
        for start, end in rng.uniform((-1.0, 2.0), (3.5, 5.0), (400, 2, 2)):
            results.append(costs.between(*start.tolist(), *end.tolist()))
            assert results[-1] == pytest.approx(sampled_cost(costs, start, end), rel=1e-5)
            assert costs.between(*start.tolist(), *start.tolist()) in (0.0, math.inf)
        assert sum(math.isfinite(cost) for cost in results) > 50
