import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.geometry.polygon_separation import convex_pieces
from simscen.core.geometry.polygons import polygon_defect
from simscen.core.geometry.polylines import path_corners

L = ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2))


@pytest.mark.parametrize(
    ("ring", "expected"),
    [
        (L, None),
        (L[::-1], None),
        ((*L, L[0]), None),
        (((0, 0), (1, 0), (1, 0), (1, 1)), None),
        (((0, 0), (1, 0), (2, 0), (2, 2)), None),
        ((*L, *L), "crosses or touches itself"),
        (((0, 0), (1, 1), (1, 0), (0, 1)), "crosses or touches itself"),
        (((0, 0), (2, 0), (2, 2), (1, 0), (0, 2)), "crosses or touches itself"),
        (((0, 0), (2, 0), (2, 1), (2, 0), (2, 3), (0, 3)), "crosses or touches itself"),
        (((0, 0), (1, 0), (2, 0)), "encloses no area"),
        (((1, 1), (1, 1), (1, 1)), "encloses no area"),
        (((0, 0), (1e-9, 0), (0, 1e-9)), "encloses no area"),
    ],
)
def test_invalid_ring_has_a_reason(ring, expected):
    assert polygon_defect(ring) == expected


RINGS = st.lists(st.tuples(st.integers(-6, 6), st.integers(-6, 6)), min_size=3, max_size=9, unique=True)


@given(RINGS)
def test_validity_of_a_ring_equals_that_of_shapely(ring):
    assert (polygon_defect(ring) is None) == shapely.Polygon(ring).is_valid


@given(RINGS)
def test_the_pieces_are_convex_counterclockwise_and_cover_the_ring_exactly_once(ring):
    if polygon_defect(ring) is not None:
        return
    pieces = [shapely.Polygon(piece) for piece in convex_pieces(ring)]
    assert all(piece.exterior.is_ccw for piece in pieces)
    assert all(piece.convex_hull.area == pytest.approx(piece.area) for piece in pieces)
    assert sum(piece.area for piece in pieces) == pytest.approx(shapely.Polygon(ring).area)
    assert shapely.union_all(pieces).symmetric_difference(shapely.Polygon(ring)).area == pytest.approx(0, abs=1e-9)


def test_pentagram_is_not_convex():
    corners = [(math.cos(0.8 * math.pi * k), math.sin(0.8 * math.pi * k)) for k in range(5)]
    with pytest.raises(ValueError, match="crosses itself"):
        convex_pieces(corners)


def test_convex_ring_is_a_single_piece():
    angles = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    ring = tuple((float(np.cos(a)), float(np.sin(a))) for a in angles)
    assert convex_pieces(ring) == [ring]
    assert len(convex_pieces(L)) == 2


def test_corners_of_a_path_are_where_it_leaves_straight_lines():
    steps = np.linspace(0.0, 2.0, 21)
    there = np.column_stack((steps, 0.01 * np.sin(20 * steps)))
    up = np.column_stack((np.full(20, 2.0), steps[1:]))
    assert path_corners(np.vstack((there, up)), 0.1) == [20]
    assert path_corners(there, 0.1) == []
    assert path_corners(np.vstack((there, there[-2::-1])), 0.1) == [20], "where it turns back"
