"""Tests of polygons against shapely: validity, containment, distances, and inscribed radius."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import (
    depth_inside_polygon,
    distance_to_polygon,
    inscribed_radius,
    points_in_polygon,
    polygon_contains,
    polygon_defect,
)
from simscen.stack.protocols import RobotModel

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


@given(RINGS, st.floats(-7, 7), st.floats(-7, 7))
def test_containment_and_distances_equal_those_of_shapely(ring, x, y):
    if polygon_defect(ring) is not None:
        return
    polygon, point, pose = shapely.Polygon(ring), shapely.Point(x, y), Pose2(x, y)
    to_border = polygon.exterior.distance(point)
    if to_border < 1e-9:
        return
    is_inside = polygon.contains(point)
    assert polygon_contains(ring, (x, y)) == is_inside
    assert points_in_polygon(ring, np.array([[x, y]])).tolist() == [is_inside]
    assert distance_to_polygon(pose, ring) == pytest.approx(0.0 if is_inside else to_border)
    assert depth_inside_polygon(pose, ring) == pytest.approx(to_border if is_inside else -1.0)


T_SHAPE = ((-0.35, -0.25), (0.2, -0.25), (0.2, -0.1), (0.5, -0.1), (0.5, 0.1), (0.2, 0.1), (0.2, 0.25), (-0.35, 0.25))
L_SHAPE = ((-0.2, -0.2), (0.6, -0.2), (0.6, 0.0), (0.2, 0.0), (0.2, 0.3), (-0.2, 0.3))


@pytest.mark.parametrize("corners", [T_SHAPE, L_SHAPE, T_SHAPE[::-1]])
def test_inscribed_radius_is_the_distance_to_the_outline(corners: tuple[tuple[float, float], ...]) -> None:
    """The lines through the edges of a concave outline can be nearer than the edges."""
    expected = shapely.Polygon(corners).exterior.distance(shapely.Point(0.0, 0.0))
    assert inscribed_radius(corners) == pytest.approx(expected)
    robot = RobotModel(corners, None, 0.5, 0.5, 0.0, 1.0, 1.0, 1.0, 1.0)
    assert robot.inscribed_radius == pytest.approx(expected)
