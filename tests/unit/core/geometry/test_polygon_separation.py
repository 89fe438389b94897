import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.geometry.polygon_separation import convex_pieces
from simscen.core.geometry.polygons import polygon_defect

L = ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2))
RINGS = st.lists(st.tuples(st.integers(-6, 6), st.integers(-6, 6)), min_size=3, max_size=9, unique=True)


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
