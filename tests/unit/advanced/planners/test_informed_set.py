"""Tests of the informed set: the length of the shortest path, and the region of all paths that are little longer."""

import math

import numpy as np
import pytest

from simscen.advanced.planners.informed_set import MAX_LEG_M, InformedSet
from simscen.model.costmaps import Costmap as Spec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot


def room_costs(*boxes: tuple[float, float, float, float], radius: float = 0.22) -> TraversalCosts:
    world = Flatland(list(boxes)).room(10, 6)
    grid = world.grid((-0.5, -0.5, 10.5, 6.5))
    robot = round_robot(radius)
    return TraversalCosts(LayeredCostmap(Spec(), Surroundings(robot, grid, TICK_RATE_HZ)).view, robot, 2.0, True)


WALL = (4.9, 0.0, 5.0, 4.0)  # the shortest path from (1, 1) to (9, 1) passes its end at (4.95, 4.22)


def test_length_in_free_space_is_the_straight_distance() -> None:
    for goal in ((9.0, 1.0), (9.0, 5.0), (3.0, 5.0)):
        straight = math.dist((1.0, 1.0), goal)
        assert InformedSet(room_costs(), (1.0, 1.0), goal).length == pytest.approx(straight, rel=0.03, abs=0.2)


def test_length_around_a_wall_is_the_length_of_the_detour() -> None:
    detour = 2 * math.hypot(3.95, 3.22)
    assert InformedSet(room_costs(WALL), (1.0, 1.0), (9.0, 1.0)).length == pytest.approx(detour, rel=0.05)


def test_narrow_informed_set_contains_the_path_but_no_side_rooms() -> None:
    informed = InformedSet(room_costs(WALL), (1.0, 1.0), (9.0, 1.0))
    informed.restrict(0.05)
    assert informed.contains(4.95, 4.5)
    assert informed.contains(3.0, 2.7)
    assert not informed.contains(1.0, 5.5)
    assert not informed.contains(4.5, 0.5)
    informed.restrict(1.0)
    assert informed.contains(1.0, 5.5)


def test_length_is_infinite_behind_a_thin_wall_or_a_too_narrow_gap() -> None:
    costs = room_costs((4.9, 0.0, 5.0, 6.0))
    assert math.isinf(InformedSet(costs, (1.0, 1.0), (9.0, 1.0)).length)
    gap = room_costs((4.9, 0.0, 5.0, 2.8), (4.9, 3.25, 5.0, 6.0), radius=0.25)
    assert math.isinf(InformedSet(gap, (1.0, 3.0), (9.0, 3.0)).length)


def test_informed_set_by_cost_contains_the_cheapest_path() -> None:
    # The walls leave a narrow gap on the straight line and a wide gap at larger y.
    costs = room_costs((4.9, 0.0, 5.0, 0.6), (4.9, 1.2, 5.0, 4.0))
    costs.rates[(costs.rates > 1.0) & (costs.rates < math.inf)] *= 20.0
    informed = InformedSet(costs, (1.0, 1.0), (9.0, 1.0), by_cost=True)
    shortest = InformedSet(costs, (1.0, 1.0), (9.0, 1.0))
    assert shortest.length == pytest.approx(8.0, rel=0.03)
    assert shortest.length < informed.length
    path = informed.path(costs.costmap, 9.0)
    assert path[:, 1].max() > 4.2
    assert np.isfinite(costs.at(path)).all()
    informed.restrict(0.05)
    assert informed.contains_points(path).all()
    assert not informed.contains_points(np.array([(4.95, 0.9)])).any()
    assert len(informed.path(costs.costmap, 0.0)) == math.ceil(len(path) / 3)


def test_waypoints_divide_a_long_path_into_equal_legs_in_free_space() -> None:
    robot, world = round_robot(0.22), Flatland([(24.0, 0.0, 26.0, 1.5)]).room(50, 4)
    view = LayeredCostmap(Spec(), Surroundings(robot, world.grid((-0.5, -0.5, 50.5, 4.5)), TICK_RATE_HZ)).view
    costs = TraversalCosts(view, robot, 2.0, True)
    informed = InformedSet(costs, (1.0, 2.0), (49.0, 2.0))
    ((point, distance),) = informed.waypoints(view)
    assert MAX_LEG_M < informed.length < 2 * MAX_LEG_M
    assert distance == pytest.approx(informed.length / 2)
    assert math.dist(point, (1.0, 2.0)) == pytest.approx(distance, abs=0.5)
    assert view.distance[costs.cell(point)] == view.distance.max()
