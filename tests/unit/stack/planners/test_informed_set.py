import math
from itertools import pairwise

import numpy as np
import pytest

from simscen.model.stack import Costmap as Spec
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.planners.field import Field
from simscen.stack.planners.informed_set import InformedSet
from simscen.stack.planners.polish import length, pull_tight, relaxed, spaced
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import RATE, Flatland, round_robot


def field(*boxes: tuple[float, float, float, float]) -> Field:
    world = Flatland(list(boxes)).room(10, 6)
    grid = world.grid((-0.5, -0.5, 10.5, 6.5))
    return Field(Costmap(Spec(), Surroundings(round_robot(), grid, RATE)).view)


WALL = (4.9, 0.0, 5.0, 4.0)  # the way from (1, 1) to (9, 1) leads over its end, at (4.95, 4.22)


def test_in_the_open_its_length_is_the_straight_distance_but_for_the_grid() -> None:
    for goal in ((9.0, 1.0), (9.0, 5.0), (3.0, 5.0)):
        straight = math.dist((1.0, 1.0), goal)
        assert InformedSet(field(), (1.0, 1.0), goal, 0.22).length == pytest.approx(straight, rel=0.03, abs=0.2)


def test_around_a_wall_its_length_is_that_of_the_way_around() -> None:
    around = 2 * math.hypot(3.95, 3.22)
    assert InformedSet(field(WALL), (1.0, 1.0), (9.0, 1.0), 0.22).length == pytest.approx(around, rel=0.05)


def test_a_narrow_set_has_the_way_and_not_the_rooms_beside_it() -> None:
    informed = InformedSet(field(WALL), (1.0, 1.0), (9.0, 1.0), 0.22)
    informed.narrow(0.05)
    assert informed.has(4.95, 4.5)
    assert informed.has(3.0, 2.7)
    assert not informed.has(1.0, 5.5)
    assert not informed.has(4.5, 0.5)
    informed.narrow(1.0)
    assert informed.has(1.0, 5.5)


def test_no_way_has_no_length_and_a_thin_wall_is_not_leapt_over() -> None:
    tested = field((4.9, 0.0, 5.0, 6.0))
    assert math.isinf(InformedSet(tested, (1.0, 1.0), (9.0, 1.0), 0.22).length)
    slit = field((4.9, 0.0, 5.0, 2.8), (4.9, 3.25, 5.0, 6.0))
    assert math.isinf(InformedSet(slit, (1.0, 3.0), (9.0, 3.0), 0.25).length)


def test_a_string_is_pulled_to_the_shortest_way_around_a_corner() -> None:
    tested = field(WALL)
    crooked = [(1.0, 1.0), (1.0, 5.0), (5.0, 5.5), (9.0, 5.0), (9.0, 1.0)]
    tight = pull_tight(tested, spaced(np.array(crooked), 0.2).tolist(), 0.22)
    assert length(tight) < 1.03 * 2 * math.hypot(3.95, 3.22) + 0.15
    assert all(tested.segment_free(*a, *b, 0.22) for a, b in pairwise(tight))


def test_the_band_keeps_its_ends_and_moves_off_walls_where_there_is_room() -> None:
    tested = field(WALL)
    hugging = spaced(np.array([(1.0, 1.0), (4.7, 4.15), (5.2, 4.15), (9.0, 1.0)]), 0.15)
    band = relaxed(tested, hugging, 0.22, 0.40)
    assert np.array_equal(band[[0, -1]], hugging[[0, -1]])
    assert tested.many(band).min() > tested.many(hugging).min() + 0.05


def test_spaced_points_are_close_enough_and_keep_every_corner() -> None:
    points = spaced(np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (1.0, 1.0)]), 0.3)
    assert points == pytest.approx(np.array(
        [(0, 0), (0.25, 0), (0.5, 0), (0.75, 0), (1, 0), (1, 0.25), (1, 0.5), (1, 0.75), (1, 1)]
    ))  # fmt: skip
    assert spaced(np.array([(1.0, 2.0), (1.0, 2.0)]), 0.3).tolist() == [[1.0, 2.0]]
