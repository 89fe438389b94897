"""Tests of costs, distances, zones, and revisions of a costmap."""

import math

import numpy as np
import pytest
from room_costmaps import BOUNDS, ROBOT, cost_and_distance_at, costmap, scan_of
from scipy.ndimage import distance_transform_edt

from simscen.core.environment.costmap_filters import Zones
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Costmap as Spec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot

MAX_DISTANCE_M = 0.72  # circumscribed radius + 0.5 m


def distances_to(lethal: np.ndarray) -> np.ndarray:
    """Return the limited distance in m of each cell to the nearest lethal cell, by SciPy."""
    return np.minimum(distance_transform_edt(~lethal) * 0.05, MAX_DISTANCE_M)


def test_distances_are_between_cell_centers() -> None:
    view = costmap(Flatland().room(8, 6)).view
    lethal = view.costs == 254
    cells, cell = np.argwhere(lethal), np.array([60, 80])
    expected = np.sqrt(((cells - cell) ** 2).sum(axis=1)).min() * 0.05
    assert view.distance[60, 80] == pytest.approx(min(expected, MAX_DISTANCE_M), abs=1e-6)
    assert np.allclose(view.distance, distances_to(lethal), atol=1e-6)


def test_costmaps_of_one_map_have_independent_distances() -> None:
    grid = Flatland().room(8, 6).grid(BOUNDS)
    for radius in (0.1, 0.3, 0.1):
        robot, zone = round_robot(radius), ((4.0, 3.0), (4.5, 3.0), (4.5, 3.5))
        for keepout in ((), (zone,)):
            map_ = LayeredCostmap(Spec(inflation_radius=0.2), Surroundings(robot, grid, TICK_RATE_HZ, keepout=keepout))
            distance = distance_transform_edt(map_.view.costs != 254) * 0.05
            assert np.allclose(map_.view.distance, np.minimum(distance, radius + 0.5), atol=1e-6)
            assert cost_and_distance_at(map_, 4.3, 3.1)[0] == (254 if keepout else 0)


def test_costs_follow_the_formula_of_nav2_up_to_the_inflation_radius() -> None:
    map_ = costmap(Flatland().room(8, 6))
    for x in (0.1, 0.3, 0.45, 0.6, 0.75):
        cost, distance = cost_and_distance_at(map_, x, 3.0)
        expected = 253 if distance <= 0.22 else int(252 * math.exp(-3.0 * (distance - 0.22)))
        assert cost == (expected if distance <= 0.70 else 0)


def test_unknown_cells_stay_unknown_unless_the_robot_would_touch_a_wall_on_them() -> None:
    cells = np.full((40, 40), -1, dtype=np.int8)
    cells[20, 20] = 100
    map_ = LayeredCostmap(Spec(), Surroundings(ROBOT, OccupancyGrid(cells, 0.05), TICK_RATE_HZ))
    assert cost_and_distance_at(map_, 1.025, 1.125)[0] == 253
    assert cost_and_distance_at(map_, 1.025, 1.725)[0] == 255


def test_a_turned_map_is_sampled_into_an_unturned_costmap() -> None:
    cells = np.zeros((40, 60), dtype=np.int8)
    cells[10, 50] = 100
    grid = OccupancyGrid(cells, 0.05, Pose2(1.0, 2.0, math.pi / 2))
    view = LayeredCostmap(Spec(), Surroundings(ROBOT, grid, TICK_RATE_HZ)).view
    row, column = np.argwhere(view.costs == 254)[0]
    x, y = grid.center_of(np.array([[10, 50]]))[0]
    assert view.origin[0] + (column + 0.5) * 0.05 == pytest.approx(x, abs=0.051)
    assert view.origin[1] + (row + 0.5) * 0.05 == pytest.approx(y, abs=0.051)


def test_incrementally_updated_distances_equal_a_full_computation() -> None:
    world = Flatland().room(8, 6)
    map_ = costmap(world)
    walls, rng = np.count_nonzero(map_.view.costs == 254), np.random.default_rng(5)
    for k in range(12):
        world.discs = [(*rng.uniform((1, 1), (7, 5)), 0.2) for _ in range(4)]
        pose = Pose2(1.0 + 0.5 * k, 3.0, 0.3 * k)
        map_.update(pose, scan_of(world, pose, noise=0.01))
        assert np.allclose(map_.view.distance, distances_to(map_.view.costs == 254), atol=1e-6)
        assert map_.obstacle_cell_count == np.count_nonzero(map_.view.costs == 254) - walls


@pytest.mark.parametrize("group", [1, 3])
def test_distances_change_only_at_points_that_are_near_reported_changes(group: int) -> None:
    world, spec = Flatland().room(8, 6), Spec(denoise_layer={"enabled": group > 1, "minimal_group_size": group})
    map_, has_changed, rng = costmap(world, spec), [], np.random.default_rng(5)
    points = rng.uniform((0.5, 0.5), (7.5, 5.5), (60, 2)) @ (1, 1j)
    for _ in range(12):
        revision, before = map_.revision, [cost_and_distance_at(map_, point.real, point.imag)[1] for point in points]
        for _ in range(2):
            x, y = rng.uniform((1.0, 1.0), (7.0, 5.0))
            world_with_discs = Flatland(world.boxes, [(x + 0.7, y, 0.02), (x, y - 1.1, 0.05)])
            map_.update(Pose2(x, y), scan_of(world_with_discs, Pose2(x, y), noise=0.03))
        for point, distance in zip(points, before, strict=True):
            has_changed.append(map_.changed_near(revision, np.array([point]), 0.4))
            assert has_changed[-1] or min(distance, 0.4) == min(
                cost_and_distance_at(map_, point.real, point.imag)[1], 0.4
            )
    assert 0.02 < np.mean(has_changed) < 0.5
    assert map_.changed_near(map_.revision - 100, points, 0.4)
    assert not map_.changed_near(map_.revision, points, 0.4)


def test_change_of_the_whole_costmap_is_a_change_near_every_point() -> None:
    map_, point = costmap(Flatland().room(8, 6)), np.array([4.0 + 3.0j])
    for change in (map_.clear, lambda: map_.set_zones(Zones((((1, 1), (2, 1), (2, 2)),)))):
        revision = map_.revision
        change()
        assert map_.changed_near(revision, point, 0.1)
        assert not map_.changed_near(map_.revision, point, 0.1)


def test_rolling_window_follows_the_robot() -> None:
    map_ = costmap(None, Spec(rolling_size=8.0))
    world = Flatland(discs=[(2.0, 0.5, 0.1)])
    map_.update(Pose2(0.0, 0.0), scan_of(world, Pose2(0.0, 0.0)))
    assert cost_and_distance_at(map_, 1.9, 0.475)[0] == 254
    map_.update(Pose2(3.0, -2.0), scan_of(Flatland(), Pose2(3.0, -2.0), range_max=0.5))
    view = map_.view
    assert view.origin == pytest.approx((-1.0, -6.0), abs=0.06)


def test_obstacles_outside_the_rolling_window_are_forgotten() -> None:
    map_ = costmap(None, Spec(rolling_size=8.0))
    map_.update(Pose2(0, 0), scan_of(Flatland(discs=[(2.0, 0.5, 0.1)]), Pose2(0, 0)))
    map_.update(Pose2(20, 0), scan_of(Flatland(), Pose2(20, 0)))
    map_.update(Pose2(0, 0), Scan("lidar", 2, np.full(4, np.nan), 0.0, 1.0, 0.05, 12.0))
    assert not (map_.view.costs == 254).any()


def test_keepout_zones_are_lethal_and_inflated() -> None:
    map_ = costmap(Flatland().room(8, 6), keepout=(((3, 2), (5, 2), (5, 4), (3, 4)),))
    assert cost_and_distance_at(map_, 4.0, 3.0) == (254, 0.0)
    assert cost_and_distance_at(map_, 2.87, 3.0)[0] == 253


def test_pose_fits_on_the_map_unless_it_is_in_a_wall() -> None:
    map_ = costmap(Flatland([(3.0, 2.0, 5.0, 4.0)]).room(8, 6))
    assert map_.fits_static(Pose2(1.5, 3.0), 0.25)
    assert not map_.fits_static(Pose2(4.0, 3.0), 0.25)
    assert map_.fits_static(Pose2(50.0, 3.0), 0.25)  # outside the costmap
    assert map_.fits_static(Pose2(1.5, -50.0), 0.25)


def test_revision_increases_with_each_change() -> None:
    world = Flatland().room(8, 6)
    map_ = costmap(world)
    before = map_.view.revision
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    assert map_.view.revision == before
    world.discs.append((4.0, 3.0, 0.1))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    assert map_.view.revision == before + 1


ZONES = (((3.0, 2.0), (5.0, 2.0), (5.0, 4.0), (3.0, 4.0)),)


def test_switching_zones_on_and_off_equals_costmaps_with_and_without_zones() -> None:
    world = Flatland().room(8, 6)
    without_zones, with_zones, switched = costmap(world), costmap(world, keepout=ZONES), costmap(world)
    world.discs = [(2.0, 3.0, 0.2)]
    scan = scan_of(world, Pose2(1.0, 3.0))
    for map_ in (without_zones, with_zones, switched):
        map_.update(Pose2(1.0, 3.0), scan)
    revision, cells = switched.view.revision, switched.obstacle_cell_count
    switched.set_zones(Zones(keepout=ZONES))
    assert np.array_equal(switched.view.costs, with_zones.view.costs)
    assert np.array_equal(switched.view.distance, with_zones.view.distance)
    assert switched.view.revision > revision, "a changed revision causes a new check of the plan"
    assert switched.obstacle_cell_count == cells + 40 * 40
    switched.set_zones(Zones())
    assert np.array_equal(switched.view.costs, without_zones.view.costs)
    assert switched.obstacle_cell_count == cells


def test_zones_can_be_switched_in_a_rolling_window() -> None:
    map_ = costmap(None, Spec(rolling_size=6.0, track_unknown_space=False))
    map_.set_zones(Zones(keepout=(((1.0, 0.5), (2.0, 0.5), (2.0, 1.5), (1.0, 1.5)),)))
    assert cost_and_distance_at(map_, 1.5, 1.0)[0] == 254
    map_.set_zones(Zones())
    assert cost_and_distance_at(map_, 1.5, 1.0)[0] == 0


def test_unknown_space_is_free_if_it_is_not_tracked() -> None:
    cells = np.full((40, 40), -1, dtype=np.int8)
    cells[20, 20] = 100
    surroundings = Surroundings(ROBOT, OccupancyGrid(cells, 0.05), TICK_RATE_HZ)
    assert cost_and_distance_at(LayeredCostmap(Spec(), surroundings), 1.025, 1.825)[0] == 255
    assert cost_and_distance_at(LayeredCostmap(Spec(track_unknown_space=False), surroundings), 1.025, 1.825)[0] == 0
    assert cost_and_distance_at(costmap(None), 5.0, 5.0)[0] == 255
    assert cost_and_distance_at(costmap(None, Spec(track_unknown_space=False)), 5.0, 5.0)[0] == 0


@pytest.mark.parametrize("inflation_radius", [0.7, 1.0])  # 1.0 m is the maximum distance
def test_beams_make_unknown_cells_free(inflation_radius: float) -> None:
    world = Flatland().room(8, 6)
    spec = Spec(inflation_radius=inflation_radius)
    from_known_map = costmap(world, spec)
    grid = world.grid(BOUNDS)
    unknown_grid = OccupancyGrid(np.where(grid.cells, 100, -1).astype(np.int8), 0.05, grid.origin)
    from_unknown_map = LayeredCostmap(spec, Surroundings(ROBOT, unknown_grid, TICK_RATE_HZ))
    pose = Pose2(4.0, 1.0)
    for costmap_ in (from_known_map, from_unknown_map):
        costmap_.update(pose, scan_of(world, pose))
    for x, y in ((4.0, 0.5), (5.5, 1.0), (4.0, 3.5), (3.0, 0.6)):
        assert cost_and_distance_at(from_unknown_map, x, y) == cost_and_distance_at(from_known_map, x, y)
    assert cost_and_distance_at(from_unknown_map, 4.0, 5.0)[0] == 255  # beyond the ray-tracing range


def test_rolling_window_keeps_known_cells() -> None:
    map_ = costmap(None, Spec(rolling_size=8.0))
    map_.update(Pose2(0.0, 0.0), scan_of(Flatland(), Pose2(0.0, 0.0)))
    map_.update(Pose2(1.5, 0.0), scan_of(Flatland(), Pose2(1.5, 0.0)))
    assert cost_and_distance_at(map_, -1.0, 0.0)[0] == 0
    assert cost_and_distance_at(map_, 5.0, 0.0)[0] == 255


@pytest.mark.parametrize(("threshold", "lethal"), [(None, (65, 100)), (100, (100,)), (30, (30, 64, 65, 100))])
@pytest.mark.parametrize("keepout", [(), (((5.0, 5.0), (6.0, 5.0), (6.0, 6.0)),)], ids=["no zone", "a zone"])
def test_lethal_cost_threshold_is_the_lowest_occupancy_of_an_obstacle(threshold, lethal, keepout) -> None:
    cells = np.zeros((40, 40), dtype=np.int8)
    occupancies = (1, 30, 64, 65, 100)
    for index, occupancy in enumerate(occupancies):
        cells[10, 5 + 5 * index] = occupancy
    spec = Spec() if threshold is None else Spec(lethal_cost_threshold=threshold)
    grid = OccupancyGrid(cells, 0.05)
    for _ in range(2):  # the second costmap uses cached data of the first one
        view = LayeredCostmap(spec, Surroundings(ROBOT, grid, TICK_RATE_HZ, keepout=keepout)).view
        marked = tuple(occupancy for index, occupancy in enumerate(occupancies) if view.costs[10, 5 + 5 * index] == 254)
        assert marked == lethal


def test_costmaps_of_one_map_have_their_own_threshold() -> None:
    grid = OccupancyGrid(np.full((20, 20), 50, dtype=np.int8), 0.05)
    costs = [
        LayeredCostmap(Spec(lethal_cost_threshold=value), Surroundings(ROBOT, grid, TICK_RATE_HZ)).view.costs[5, 5]
        for value in (65, 50, 65)
    ]
    assert costs == [0, 254, 0]
