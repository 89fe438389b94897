"""Tests of convex pieces of polygons, and of the distance of moving polygons."""

import math
import tracemalloc

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.environment.world_model import disc_outline
from simscen.core.geometry.polygon_separation import convex_pieces, separation
from simscen.core.geometry.polygons import polygon_defect

L_SHAPE = ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2))
RINGS = st.lists(st.tuples(st.integers(-6, 6), st.integers(-6, 6)), min_size=3, max_size=9, unique=True)


@given(RINGS)
def test_pieces_are_convex_and_counterclockwise_and_cover_the_ring_exactly_once(ring):
    if polygon_defect(ring) is not None:
        return
    pieces = [shapely.Polygon(piece) for piece in convex_pieces(ring)]
    assert all(piece.exterior.is_ccw for piece in pieces)
    assert all(piece.convex_hull.area == pytest.approx(piece.area) for piece in pieces)
    assert sum(piece.area for piece in pieces) == pytest.approx(shapely.Polygon(ring).area)
    assert shapely.union_all(pieces).symmetric_difference(shapely.Polygon(ring)).area == pytest.approx(0, abs=1e-9)


def test_polygon_that_crosses_itself_has_no_pieces():
    corners = [(math.cos(0.8 * math.pi * k), math.sin(0.8 * math.pi * k)) for k in range(5)]
    with pytest.raises(ValueError, match="crosses itself"):
        convex_pieces(corners)


def test_convex_ring_is_a_single_piece():
    angles = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    ring = tuple((float(np.cos(a)), float(np.sin(a))) for a in angles)
    assert convex_pieces(ring) == [ring]
    assert len(convex_pieces(L_SHAPE)) == 2


def test_distances_at_many_poses_need_little_memory():
    moving, fixed = disc_outline((0.0, 0.0), 0.3), disc_outline((20.0, 5.0), 2.0)
    poses = np.column_stack((np.linspace(0, 50, 12_000), np.zeros((12_000, 2))))
    tracemalloc.start()
    distances = separation(poses, moving, fixed)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    expected = shapely.Polygon(fixed).distance(shapely.affinity.translate(shapely.Polygon(moving), 10.0))
    assert np.interp(10.0, poses[:, 0], distances) == pytest.approx(expected, abs=1e-3)
    assert peak < 150e6
