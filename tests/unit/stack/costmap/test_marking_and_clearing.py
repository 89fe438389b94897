"""Tests of the cells that scans mark and clear, and of clearing a costmap."""

import math
from dataclasses import replace

import numpy as np
import pytest
from room_costmaps import cost_and_distance_at, costmap, scan_of

from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Costmap as Spec
from simscen.testing.flatland import Flatland


def test_hits_are_marked_only_up_to_the_obstacle_range() -> None:
    world = Flatland().room(8, 6)
    map_ = costmap(world)
    world.discs += [(4.0, 3.0, 0.1), (7.0, 3.0, 0.1)]
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    assert cost_and_distance_at(map_, 3.92, 3.0)[0] == 254
    assert cost_and_distance_at(map_, 6.92, 3.0)[0] == 0


def test_removed_obstacle_is_cleared_and_the_map_restored() -> None:
    world = Flatland().room(8, 6)
    map_ = costmap(world)
    before = map_.view.costs.copy(), map_.view.distance.copy()
    world.discs.append((4.0, 3.0, 0.3))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    assert not np.array_equal(map_.view.costs, before[0])
    world.discs.pop()
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    assert np.array_equal(map_.view.costs, before[0])
    assert np.array_equal(map_.view.distance, before[1])


def test_walls_of_the_map_are_never_cleared() -> None:
    map_ = costmap(Flatland().room(8, 6))
    before = map_.view.costs.copy()
    map_.update(Pose2(1.0, 1.0), scan_of(Flatland(), Pose2(1.0, 1.0)))
    assert np.array_equal(map_.view.costs, before)


@pytest.mark.parametrize(
    ("ranges", "inf_is_valid", "is_cleared"),
    [
        (np.inf, True, True),
        (np.inf, False, False),
        (np.nan, True, False),
        (0.01, True, False),
        (13.0, True, True),
        (13.0, False, False),
        (4.0, False, True),
    ],
)
def test_only_valid_beams_clear_cells(ranges: float, inf_is_valid: bool, is_cleared: bool) -> None:
    world = Flatland().room(8, 6)
    map_ = costmap(world, Spec(inf_is_valid=inf_is_valid))
    world.discs.append((4.0, 3.0, 0.1))
    scan = scan_of(world, Pose2(2.0, 3.0))
    map_.update(Pose2(2.0, 3.0), scan)
    second_scan = Scan("lidar", 1, np.full(360, ranges), scan.angle_min, scan.angle_increment, 0.05, 12.0)
    map_.update(Pose2(2.0, 3.0), second_scan)
    assert (cost_and_distance_at(map_, 3.92, 3.0)[0] != 254) == is_cleared


@pytest.mark.parametrize(("yaw", "is_cleared"), [(0.0, True), (0.5, False), (math.pi / 2, False), (math.pi, False)])
def test_a_single_beam_clears_only_the_cells_that_it_crosses(yaw: float, is_cleared: bool) -> None:
    world = Flatland().room(8, 6)
    map_ = costmap(world)
    world.discs.append((4.0, 3.0, 0.1))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    beam = Scan("lidar", 1, np.array([10.0]), 0.0, 2 * math.pi, 0.05, 12.0)  # a lidar with `beams: 1`
    map_.update(Pose2(2.0, 3.0, yaw), beam)
    assert (cost_and_distance_at(map_, 3.92, 3.0)[0] != 254) == is_cleared


def test_an_obstacle_beyond_the_ray_tracing_range_persists() -> None:
    world = Flatland().room(8, 6)
    map_ = costmap(world)
    world.discs.append((4.0, 3.0, 0.1))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    world.discs.pop()
    map_.update(Pose2(0.6, 3.0), scan_of(world, Pose2(0.6, 3.0)))
    assert cost_and_distance_at(map_, 3.92, 3.0)[0] == 254


def test_clearing_removes_unseen_obstacles_and_keeps_visible_ones() -> None:
    world = Flatland().room(8, 6)
    map_ = costmap(world)
    world.discs.append((4.0, 3.0, 0.1))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    world.discs = [(1.5, 3.0, 0.1)]
    map_.update(Pose2(0.6, 3.0), scan_of(world, Pose2(0.6, 3.0)))
    map_.clear()
    assert cost_and_distance_at(map_, 3.92, 3.0)[0] != 254
    assert cost_and_distance_at(map_, 1.42, 3.0)[0] == 254


@pytest.mark.parametrize("radius", [math.inf, 3.0])
def test_clearing_keeps_near_obstacles_outside_the_field_of_view(radius: float) -> None:
    world = Flatland([], [(3.3, 3.0, 0.1), (1.4, 3.0, 0.1), (3.0, 3.6, 0.1)]).room(8, 6)
    map_ = costmap(Flatland().room(8, 6))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    full_scan = scan_of(Flatland().room(8, 6), Pose2(3.9, 3.0))
    scan_ahead = replace(
        full_scan, ranges=full_scan.ranges[45:-45], angle_min=full_scan.angle_min + 45 * full_scan.angle_increment
    )
    map_.update(Pose2(3.9, 3.0), scan_ahead)
    assert cost_and_distance_at(map_, 3.22, 3.0)[0] == cost_and_distance_at(map_, 1.48, 3.0)[0] == 254
    map_.clear(radius)
    assert cost_and_distance_at(map_, 3.22, 3.0)[0] == 254
    assert cost_and_distance_at(map_, 1.48, 3.0)[0] != 254
    map_.update(Pose2(3.9, 3.0), full_scan)
    assert cost_and_distance_at(map_, 3.22, 3.0)[0] != 254


def test_clearing_keeps_unseen_obstacles_within_the_given_distance() -> None:
    world = Flatland([], [(1.4, 3.0, 0.1)]).room(8, 6)
    map_ = costmap(Flatland().room(8, 6))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    full_scan = scan_of(Flatland().room(8, 6), Pose2(3.9, 3.0))
    scan_ahead = replace(
        full_scan, ranges=full_scan.ranges[45:-45], angle_min=full_scan.angle_min + 45 * full_scan.angle_increment
    )
    map_.update(Pose2(3.9, 3.0), scan_ahead)
    map_.clear(unseen_margin=3.0)
    assert cost_and_distance_at(map_, 1.48, 3.0)[0] == 254


def test_clearing_around_the_robot_keeps_distant_obstacles() -> None:
    world = Flatland([], [(4.0, 3.0, 0.1), (2.0, 4.2, 0.1)]).room(8, 6)
    map_ = costmap(Flatland().room(8, 6))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    blind = scan_of(world, Pose2(2.0, 3.0))
    map_.update(Pose2(2.0, 3.0), replace(blind, ranges=np.full_like(blind.ranges, np.nan)))
    assert (cost_and_distance_at(map_, 3.92, 3.0)[0], cost_and_distance_at(map_, 2.0, 4.12)[0]) == (254, 254)
    map_.clear(1.5)
    assert cost_and_distance_at(map_, 3.92, 3.0)[0] == 254
    assert cost_and_distance_at(map_, 2.0, 4.12)[0] != 254


def test_costmap_is_cleared_around_the_robot_although_one_lidar_is_silent() -> None:
    world = Flatland([], [(2.0, 4.2, 0.1), (6.0, 4.2, 0.1)]).room(8, 6)
    map_ = costmap(Flatland().room(8, 6))
    blind = replace(scan_of(world, Pose2(2.0, 3.0)), ranges=np.full(360, np.nan))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    map_.update(Pose2(2.0, 3.0), replace(blind, sensor="rear"))  # the last scan of the lidar `rear`
    map_.update(Pose2(6.0, 3.0), scan_of(world, Pose2(6.0, 3.0)))
    map_.update(Pose2(6.0, 3.0), blind)
    assert (cost_and_distance_at(map_, 2.0, 4.12)[0], cost_and_distance_at(map_, 6.0, 4.12)[0]) == (254, 254)
    map_.clear(1.5)
    assert cost_and_distance_at(map_, 2.0, 4.12)[0] == 254
    assert cost_and_distance_at(map_, 6.0, 4.12)[0] != 254


def test_cells_under_the_robot_are_free() -> None:
    world = Flatland().room(8, 6)
    map_ = costmap(world)
    world.discs.append((2.3, 3.0, 0.1))
    map_.update(Pose2(2.0, 3.0), scan_of(world, Pose2(2.0, 3.0)))
    map_.update(Pose2(2.2, 3.0), scan_of(Flatland(), Pose2(2.2, 3.0), range_max=0.06))
    assert cost_and_distance_at(map_, 2.2, 3.0)[0] != 254
