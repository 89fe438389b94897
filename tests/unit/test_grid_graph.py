import math

import numpy as np
import pytest

from simscen.grid_graph import GridGraph


def grid_without(shape, *cells):
    free = np.ones(shape, dtype=bool)
    for cell in cells:
        free[cell] = False
    return free


def length(path):
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def test_paths_in_16_directions_are_exact_and_others_at_most_3_percent_longer():
    lattice = GridGraph(np.ones((60, 60), dtype=bool))
    for goal in ((10, 50), (50, 10), (50, 50), (30, 50)):
        assert length(lattice.shortest_path((10, 10), goal)) == pytest.approx(math.dist((10, 10), goal))
    for goal in np.random.default_rng(0).integers(4, 56, (50, 2)).tolist():
        straight = math.dist((10, 10), goal)
        assert straight <= length(lattice.shortest_path((10, 10), tuple(goal))) + 1e-9 <= 1.028 * straight + 1e-9


def test_no_move_cuts_a_corner_or_jumps_over_a_cell():
    free = np.random.default_rng(1).random((40, 40)) > 0.25
    free[2:5, 2:5] = free[35:38, 35:38] = True
    path = GridGraph(free).shortest_path((3, 3), (36, 36))
    assert free[path[:, 0], path[:, 1]].all()
    for (r, c), (to_r, to_c) in zip(path[:-1].tolist(), path[1:].tolist(), strict=True):
        for t in np.linspace(0.0, 1.0, 31):
            for offset in (-0.01, 0.01):  # both sides, as moves can follow the border of two cells
                row = math.floor(r + 0.5 + t * (to_r - r) + offset * (to_c - c))
                column = math.floor(c + 0.5 + t * (to_c - c) - offset * (to_r - r))
                assert free[row, column]


def test_no_path_leads_through_a_wall_and_ends_must_be_free():
    lattice = GridGraph(grid_without((20, 20), (slice(None), 10)))
    assert lattice.shortest_path((5, 5), (5, 15)) is None
    assert lattice.shortest_path((5, 10), (5, 15)) is None
    assert lattice.shortest_path((5, 5), (5, 5)).tolist() == [[5, 5]]
