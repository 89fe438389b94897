"""Tests of the distance field on and outside the map."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.core.environment.occupancy_grid import OCCUPIED, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.stack.localizers.distance_field import DistanceField


def random_grid(seed: int, origin: Pose2 = Pose2(-1.3, 0.4, 0.0)) -> OccupancyGrid:
    cells = np.where(np.random.default_rng(seed).random((17, 23)) < 0.04, OCCUPIED, 0).astype(np.int8)
    return OccupancyGrid(cells, 0.1, origin)


@pytest.mark.parametrize("seed", range(5))
def test_distances_are_between_cell_centers(seed: int) -> None:
    grid = random_grid(seed)
    field = DistanceField(grid, grid.cells == OCCUPIED, 0.5, walled=False)
    rows, columns = np.indices(grid.shape).reshape(2, -1)
    obstacles = np.argwhere(grid.cells == OCCUPIED)
    exact = np.hypot(rows[:, None] - obstacles[:, 0], columns[:, None] - obstacles[:, 1]).min(axis=1) * 0.1
    inner = field.table.reshape(19, 25)[1:-1, 1:-1]
    assert np.allclose(inner.ravel(), np.minimum(exact, 0.5))


def test_distances_without_obstacles_are_at_the_maximum() -> None:
    grid = OccupancyGrid(np.zeros((4, 5), dtype=np.int8), 0.1)
    assert (DistanceField(grid, grid.cells == OCCUPIED, 2.0, walled=False).table == 2).all()


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 9), st.floats(-3, 3), st.floats(-1e9, 1e9), st.floats(-4, 4), st.floats(-4, 4), st.floats(-4, 4))
def test_point_is_mapped_to_its_cell_or_the_border(
    seed: int, map_yaw: float, far_x: float, x: float, y: float, yaw: float
) -> None:
    grid = random_grid(seed, Pose2(-1.3, 0.4, map_yaw))
    field = DistanceField(grid, grid.cells == OCCUPIED, 2.0, walled=False)
    pose, points = Pose2(x, y, yaw), np.array([[0.0, 0.0], [0.51, 0.77], [-1.1, 0.3], [far_x, 1.0]])
    field_distances = field.table[field.endpoint_cells(np.array([pose]), points @ (1, 1j))[0]]
    for point, distance in zip(pose.apply(points), field_distances, strict=True):
        # With single precision, a point near the edge of a cell can be mapped to the adjacent cell.
        corners = point + 2e-5 * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
        possible = set()
        for row, column in grid.cell_of(corners):
            on_map = 0 <= row < 17 and 0 <= column < 23
            possible.add(float(field.table.reshape(19, 25)[row + 1, column + 1]) if on_map else 2.0)
        assert distance in possible
