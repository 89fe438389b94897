"""Tests of the tightening of a path around obstacles."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose3
from simscen.core.geometry.polylines import polyline_length, resample_polyline
from simscen.core.geometry.shapes import Cylinder, Solid
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.occupancy_map import empty_grid
from simscen.worlds.routes.clearance import clearance_field
from simscen.worlds.routes.shortest_paths import is_line_clear, tighten_path

POST = merge_solids([Solid(Cylinder(0.5, 1.0), Pose3(0, 0, 0.5))])
FIELD = clearance_field(POST, empty_grid((-3, -3, 3, 3), 0.05), (0.03, 0.4))


def test_detour_around_a_post_is_tightened_on_its_side_of_the_post():
    tangents = 2 * math.sqrt(2.0**2 - 0.8**2)
    arc = 0.8 * (math.pi - 2 * math.acos(0.8 / 2.0))
    for side in (1, -1):
        detour = np.array([(-2.0, 0.0), (-2.5, 1.5 * side), (-1.0, 2.5 * side), (1.5, 1.4 * side), (2.0, 0.0)])
        taut = tighten_path(resample_polyline(detour, 0.05), FIELD, 0.3)
        assert polyline_length(taut) == pytest.approx(tangents + arc, rel=0.005)
        assert np.all(taut[:, 1] * side > -1e-9)


def test_line_is_clear_if_all_of_it_has_the_clearance():
    a, b = np.array([-2.0, 0.82]), np.array([2.0, 0.82])
    assert is_line_clear(a, b, FIELD, 0.3)
    assert not is_line_clear(a, b - (0, 0.05), FIELD, 0.3)


def test_resampling_keeps_ends_and_length():
    path = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    resampled = resample_polyline(path, 0.03)
    assert np.array_equal(resampled[[0, -1]], path[[0, -1]])
    assert np.linalg.norm(np.diff(resampled, axis=0), axis=1).max() <= 0.03 + 1e-12
    assert polyline_length(resampled) == pytest.approx(2.0, rel=0.01)
