"""Tests of shifted and outdated maps."""

import math

import numpy as np
import pytest
from fault_effects import start

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Pose2


def grid() -> OccupancyGrid:
    """Return a map of 10 m by 10 m with a wall cell at (2, 3) and an unknown cell at (9, 9)."""
    cells = np.zeros((20, 20), dtype=np.int8)
    cells[6, 4], cells[18, 18] = OCCUPIED, UNKNOWN
    return OccupancyGrid(cells, 0.5)


def value(grid: OccupancyGrid, x: float, y: float) -> int:
    return int(grid.values_at(np.array([[x, y]]))[0])


def test_shifted_map_moves_every_point():
    shifted = start({"shift": {"x": 1.0, "y": -0.5, "yaw": "90 deg"}}, "Map").map(grid())
    wall_cell = Pose2(1.0, -0.5, math.pi / 2).apply(np.array([[2.25, 3.25]]))[0].tolist()
    assert wall_cell == pytest.approx([1.0 - 3.25, -0.5 + 2.25])
    assert value(shifted, *wall_cell) == OCCUPIED
    assert value(shifted, 2.25, 3.25) == UNKNOWN


def test_outdated_map_has_free_missing_areas_and_occupied_extra_areas():
    spec = {"missing": [[[1.8, 2.8], [2.7, 2.8], [2.7, 3.7], [1.8, 3.7]]], "extra": [[[5, 5], [7, 5], [7, 6], [5, 6]]]}
    original = grid()
    outdated = start({"outdated": spec}, "Map").map(original)
    assert value(outdated, 2.25, 3.25) == FREE
    assert int((outdated.cells == OCCUPIED).sum()) == 4 * 2
    assert value(outdated, 5.25, 5.25) == value(outdated, 6.75, 5.75) == OCCUPIED
    assert value(outdated, 9.25, 9.25) == UNKNOWN
    assert value(original, 2.25, 3.25) == OCCUPIED, "the shared map is not modified"
