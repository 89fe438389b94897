"""Tests of the denoise layer, as in nav2_costmap_2d."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Costmap as Spec
from simscen.model.costmaps import DenoiseLayer
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.costmap.obstacle_layer import remove_small_groups
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot


def scan_of(world: Flatland, pose: Pose2, noise: float) -> Scan:
    step = 2 * math.pi / 360
    ranges = world.cast((pose.x, pose.y), -math.pi + step * np.arange(360) + pose.yaw)
    ranges = ranges + np.random.default_rng(3).normal(0, noise, 360)
    return Scan("lidar", 0, np.where(ranges > 12.0, np.inf, ranges), -math.pi, step, 0.05, 12.0)


CELLS = """
#.....##...
.#.....#...
......#....
...........
#..........
"""
MARKED = np.array([[c == "#" for c in row] for row in CELLS.split()])
NO_WALLS = np.zeros_like(MARKED)


@pytest.mark.parametrize(
    ("size", "connectivity", "remaining"),
    [(1, 8, 7), (2, 8, 6), (3, 8, 4), (5, 8, 0), (2, 4, 3), (3, 4, 3), (4, 4, 0)],
)
def test_groups_below_the_minimal_size_are_removed(size: int, connectivity: int, remaining: int) -> None:
    spec = DenoiseLayer(enabled=True, minimal_group_size=size, group_connectivity_type=connectivity)
    result = remove_small_groups(MARKED, NO_WALLS, spec)
    assert result.sum() == remaining
    assert not (result & ~MARKED).any()


def test_cell_next_to_a_wall_belongs_to_its_group() -> None:
    walls = NO_WALLS.copy()
    walls[3, :] = True
    kept = remove_small_groups(MARKED, walls, DenoiseLayer(enabled=True, minimal_group_size=8))
    assert kept[4, 0]
    assert not kept[0, 0]


def test_incremental_updates_equal_a_full_computation() -> None:
    """A costmap that is updated around changed cells equals a costmap that is computed anew from the same marks."""
    rng = np.random.default_rng(5)
    world = Flatland(discs=[(x, y, 0.03) for x, y in rng.uniform(-3, 3, (12, 2)).tolist() if math.hypot(x, y) > 1])
    spec = Spec(denoise_layer=DenoiseLayer(enabled=True, minimal_group_size=4), rolling_size=8.0)
    map_ = LayeredCostmap(spec, Surroundings(round_robot(), None, TICK_RATE_HZ))
    for k in range(6):
        pose = Pose2(0.1 * k, 0.0)
        map_.update(pose, scan_of(world, pose, noise=0.03))
        costs, distance = map_.view.costs.copy(), map_.view.distance.copy()
        map_._reset_to_static_layer()
        assert np.array_equal(map_.view.costs, costs)
        assert np.array_equal(map_.view.distance, distance)
