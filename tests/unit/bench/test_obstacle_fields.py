"""Tests of generated obstacle fields against the geometry library shapely."""

import numpy as np
import pytest
from shapely import MultiPoint, Point, box

from simscen.bench.navigation.barn import GOAL, START
from simscen.bench.navigation.obstacle_fields import (
    CELL_SIZE_M,
    COLUMNS,
    CROSSING_RADIUS_M,
    FIELD_ROWS,
    ROWS,
    generate_obstacle_field,
)


def test_field_depends_only_on_its_number() -> None:
    first, repeated, other = generate_obstacle_field(3), generate_obstacle_field(3), generate_obstacle_field(4)
    assert np.array_equal(first.centers, repeated.centers)
    assert not np.array_equal(first.centers, other.centers)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_disc_can_pass_according_to_an_independent_library(number: int) -> None:
    field = generate_obstacle_field(number)
    lane = box(-30 * CELL_SIZE_M, 0.0, 0.0, GOAL.y + 1.0)
    # The radius is reduced by 2 mm, because circles of shapely are polygons, and the search uses a lattice.
    free = lane.difference(MultiPoint(field.centers).buffer(CELL_SIZE_M / 2 + CROSSING_RADIUS_M - 0.002))
    parts = [part for part in getattr(free, "geoms", [free]) if part.contains(Point(START.x, START.y))]
    assert parts and parts[0].contains(Point(GOAL.x, GOAL.y))


def test_the_shortest_path_is_no_shorter_than_the_straight_line() -> None:
    assert 10.0 <= generate_obstacle_field(1).shortest_path_m < 20.0


@pytest.mark.slow
def test_fields_are_as_dense_as_the_worlds_of_barn() -> None:
    def density(number: int) -> float:
        """Return the fraction of filled cells of the obstacle field, without the walls."""
        x, y = generate_obstacle_field(number).centers.T
        inside = np.abs(x + COLUMNS * CELL_SIZE_M / 2) < (COLUMNS / 2 - 1) * CELL_SIZE_M
        count = np.count_nonzero(inside & (y > (ROWS - FIELD_ROWS) * CELL_SIZE_M))
        return float(count) / (FIELD_ROWS * (COLUMNS - 2))

    assert 0.05 < np.mean([density(number) for number in range(1, 9)]) < 0.22


def test_narrow_field_width_matches_an_independent_library() -> None:
    crossing_radius, blocked_radius = 0.31, 0.36
    field = generate_obstacle_field(2, crossing_radius, blocked_radius)
    lane = box(-30 * CELL_SIZE_M, 0.0, 0.0, GOAL.y + 1.0)

    def is_crossable(radius: float) -> bool:
        free = lane.difference(MultiPoint(field.centers).buffer(CELL_SIZE_M / 2 + radius))
        parts = [part for part in getattr(free, "geoms", [free]) if part.contains(Point(START.x, START.y))]
        return bool(parts) and bool(parts[0].contains(Point(GOAL.x, GOAL.y)))

    assert is_crossable(crossing_radius - 0.002)
    assert not is_crossable(blocked_radius + CELL_SIZE_M / 3)  # the resolution of the lattice that is searched


def test_width_option_does_not_change_the_default_fields() -> None:
    assert generate_obstacle_field(3).shortest_path_m == generate_obstacle_field(3, CROSSING_RADIUS_M).shortest_path_m
