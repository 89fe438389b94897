"""Tests of overlaps of polygons."""

from math import cos, pi, sin

import pytest

from simscen.worlds.geometry.overlaps import polygons_overlap

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
ROUND = tuple((0.2 * cos(2 * pi * k / 16), 0.2 * sin(2 * pi * k / 16)) for k in range(16))


@pytest.mark.parametrize("ring", [SQUARE, ROUND], ids=["square", "round"])
@pytest.mark.parametrize("shift", [0, 1, 2, 4])
def test_polygon_overlaps_itself_for_any_first_corner(ring, shift):
    assert polygons_overlap(ring, (*ring[shift:], *ring[:shift]))


def test_polygons_side_by_side_do_not_overlap():
    assert not polygons_overlap(SQUARE, tuple((x + 2, y) for x, y in SQUARE))


def test_a_polygon_within_another_overlaps_it():
    inner = tuple((0.5 + 0.1 * x, 0.5 + 0.1 * y) for x, y in SQUARE)
    assert polygons_overlap(SQUARE, inner)
    assert polygons_overlap(inner, SQUARE)
