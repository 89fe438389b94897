"""Tests of polygons that are assembled from the segments of a cross section."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import Polygon, union_all

from simscen.worlds.geometry.section_polygons import (
    OpenCrossSection,
    rings_from_segments,
    signed_area,
    simple_polygons,
)


def segments(*rings, shuffle=0):
    """Return the directed sides of the rings in random order."""
    sides = [(a, b) for ring in rings for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)]
    order = np.random.default_rng(shuffle).permutation(len(sides))
    return np.array(sides, dtype=np.float64)[order]


def square(side, x=0.0, y=0.0):
    half = side / 2
    return [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]


def circle(radius, count):
    angles = np.arange(count) * 2 * math.pi / count
    return [(radius * math.cos(a), radius * math.sin(a)) for a in angles.tolist()]


def same_ring(ring, other):
    return Polygon(ring).equals(Polygon(other))


@pytest.mark.parametrize("shuffle", range(5))
def test_ring_is_assembled_from_its_sides_in_any_order(shuffle):
    (ring,) = rings_from_segments(segments(square(2.0), shuffle=shuffle))
    assert same_ring(ring, square(2.0))
    assert signed_area(ring) == pytest.approx(4.0)


def test_points_on_straight_edges_are_removed():
    dense = [(x, 0.0) for x in (0.0, 0.3, 0.31, 1.9, 2.0)] + [(2.0, 1.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.5)]
    (ring,) = rings_from_segments(segments(dense))
    assert len(ring) == 4
    assert signed_area(ring) == pytest.approx(2.0)


def test_circular_ring_keeps_its_corners():
    (ring,) = rings_from_segments(segments(circle(0.5, 180)))
    assert len(ring) == 180


def test_open_cross_section_raises():
    with pytest.raises(OpenCrossSection):
        rings_from_segments(segments(square(1.0))[:-1])


def test_outer_rings_without_holes_stay_whole_and_others_become_triangles():
    room = [square(10.0), square(9.0)[::-1], square(1.0)]
    pieces = simple_polygons(rings_from_segments(segments(*room)))
    expected = Polygon(room[0]).difference(Polygon(room[1])).union(Polygon(room[2]))
    assert union_all([Polygon(piece) for piece in pieces]).symmetric_difference(expected).area < 1e-9
    assert sum(map(signed_area, pieces)) == pytest.approx(expected.area)
    assert any(same_ring(piece, room[2]) for piece in pieces)


def test_ring_with_too_many_corners_is_split():
    pieces = simple_polygons([circle(3.0, 400)])
    assert all(len(piece) <= 200 for piece in pieces)
    assert sum(map(signed_area, pieces)) == pytest.approx(Polygon(circle(3.0, 400)).area)


HOLE_THAT_TOUCHES_THE_OUTSIDE = [(0, 0), (0, 1), (0, 2), (0, 4), (1, 0), (1, 2), (2, 0), (2, 1)]


@settings(max_examples=30, deadline=None)
@example(HOLE_THAT_TOUCHES_THE_OUTSIDE)
@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=12, unique=True))
def test_pieces_of_any_grid_cells_cover_the_same_area(cells):
    """Unions of grid cells have rings that touch at corners, holes, and islands in holes."""
    union = union_all([Polygon(square(1.0, float(x), float(y))) for x, y in cells])
    parts = list(union.geoms) if union.geom_type == "MultiPolygon" else [union]
    rings = []
    for part in parts:
        oriented = part.normalize()
        rings.append(_oriented(list(oriented.exterior.coords)[:-1], 1))
        rings += [_oriented(list(hole.coords)[:-1], -1) for hole in oriented.interiors]
    pieces = simple_polygons(rings_from_segments(segments(*rings)))
    assert sum(map(signed_area, pieces)) == pytest.approx(union.area)
    assert union_all([Polygon(piece) for piece in pieces]).symmetric_difference(union).area < 1e-9


def _oriented(ring, sign):
    return ring if signed_area(ring) * sign > 0 else ring[::-1]
