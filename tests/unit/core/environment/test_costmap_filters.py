"""Tests of speed limits from the mask of a costmap filter."""

import numpy as np
import pytest

from simscen.core.environment.costmap_filters import SpeedLimits
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2


def limits(value, *, percent=True, base=0.0, multiplier=1.0):
    """Return the speed limits of a mask of 2 x 2 m in which each cell has the value."""
    grid = OccupancyGrid(np.full((2, 2), value, dtype=np.int8), 1.0)
    return SpeedLimits(grid, percent, base, multiplier)


@pytest.mark.parametrize(
    ("value", "options", "limit"),
    [
        (40, {}, 0.2),
        (40, {"base": 100.0, "multiplier": -1.0}, 0.3),
        (40, {"percent": False, "multiplier": 0.01}, 0.4),
        (0, {"base": 50.0}, None),  # SPEED_MASK_NO_LIMIT
        (-1, {"base": 50.0}, None),
        (100, {"base": 100.0, "multiplier": -1.0}, None),  # 0 means no limit in nav2_msgs/SpeedLimit
        (50, {"base": 100.0}, None),  # 150 percent
    ],
)
def test_speed_limit_of_a_cell_equals_that_of_nav2(value, options, limit):
    assert limits(value, **options).at(Pose2(1.0, 1.0), 0.5) == (None if limit is None else pytest.approx(limit))


def test_there_is_no_limit_outside_the_mask():
    assert limits(40).at(Pose2(3.0, 1.0), 0.5) is None
