import numpy as np
import pytest
from shapely import MultiPoint, Point, box

from simscen.bench.navigation import barn
from simscen.bench.navigation.barn import CELL_SIZE_M, CROSSING_RADIUS_M, GOAL, START, generate_obstacle_field


def test_field_depends_only_on_its_number() -> None:
    first, again, other = generate_obstacle_field(3), generate_obstacle_field(3), generate_obstacle_field(4)
    assert np.array_equal(first.centers, again.centers)
    assert not np.array_equal(first.centers, other.centers)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_disc_can_pass_according_to_an_independent_library(number: int) -> None:
    field = generate_obstacle_field(number)
    lane = box(-30 * CELL_SIZE_M, 0.0, 0.0, GOAL.y + 1.0)
    # 2 mm less than the disc: shapely's circles are polygons, and a lattice finds ways to its resolution only.
    free = lane.difference(MultiPoint(field.centers).buffer(CELL_SIZE_M / 2 + CROSSING_RADIUS_M - 0.002))
    pieces = [piece for piece in getattr(free, "geoms", [free]) if piece.contains(Point(START.x, START.y))]
    assert pieces and pieces[0].contains(Point(GOAL.x, GOAL.y))


def test_the_shortest_path_is_no_shorter_than_the_straight_line() -> None:
    assert 10.0 <= generate_obstacle_field(1).shortest_path_m < 20.0


@pytest.mark.slow
def test_fields_are_as_dense_as_the_worlds_of_barn() -> None:
    densities = [generate_obstacle_field(number).density for number in range(1, 9)]
    assert 0.05 < np.mean(densities) < 0.22


def test_cellular_automaton_removes_isolated_cells_and_fills_crowded_ones() -> None:
    alone = np.zeros((3, 3), np.bool_)
    alone[1, 1] = True
    assert barn._count_neighbors(alone).tolist() == [[1, 1, 1], [1, 0, 1], [1, 1, 1]]


def test_narrow_field_width_matches_an_independent_library() -> None:
    crossing_radius, blocked_radius = 0.31, 0.36
    field = generate_obstacle_field(2, crossing_radius, blocked_radius)
    lane = box(-30 * CELL_SIZE_M, 0.0, 0.0, GOAL.y + 1.0)

    def crossable(radius: float) -> bool:
        free = lane.difference(MultiPoint(field.centers).buffer(CELL_SIZE_M / 2 + radius))
        pieces = [piece for piece in getattr(free, "geoms", [free]) if piece.contains(Point(START.x, START.y))]
        return bool(pieces) and bool(pieces[0].contains(Point(GOAL.x, GOAL.y)))

    assert crossable(crossing_radius - 0.002)
    assert not crossable(blocked_radius + CELL_SIZE_M / 3)  # as fine as the lattice on which that is looked for


def test_width_option_does_not_change_the_default_fields() -> None:
    assert generate_obstacle_field(3).shortest_path_m == generate_obstacle_field(3, CROSSING_RADIUS_M).shortest_path_m
