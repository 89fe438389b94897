"""Tests of the grid cells that a cross section fills or touches."""

import numpy as np
import pytest
import shapely

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Extrusion, Solid
from simscen.worlds.geometry.cross_section import CrossSection, cross_section
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.rasterization import expand_ranges, filled_cells, touched_cells

STAR = tuple(
    (10 + r * np.cos(a), 10 + r * np.sin(a)) for r, a in zip([8, 3] * 5, np.arange(10) * np.pi / 5, strict=True)
)


def star_at(*offsets):
    """Return the cross section of a star at each of the offsets."""
    return cross_section(merge_solids(Solid(Extrusion(STAR, 1.0), Pose3(x, y, 0)) for x, y in offsets), 0.5)


def test_filled_cells_are_those_whose_center_is_inside():
    x, y = np.meshgrid(np.arange(20) + 0.5, np.arange(20) + 0.5)
    expected = shapely.contains_xy(shapely.Polygon(STAR), x, y)
    assert np.array_equal(filled_cells(star_at((0, 0)), (20, 20)), expected)


def test_overlapping_solids_fill_their_union():
    union = filled_cells(star_at((0, 0), (3.3, 1.7)), (24, 24))
    first, second = filled_cells(star_at((0, 0)), (24, 24)), filled_cells(star_at((3.3, 1.7)), (24, 24))
    assert np.array_equal(union, first | second)


def test_grid_that_ends_within_a_solid_contains_a_part_of_it():
    whole = touched_cells(star_at((0, 0)), (20, 20))
    assert np.array_equal(touched_cells(star_at((0, 0)), (12, 9)), whole[:12, :9])
    shifted = touched_cells(star_at((-7, -6)), (14, 13))
    assert np.array_equal(shifted, whole[6:, 7:])


def test_empty_cross_section_touches_no_cells():
    assert not touched_cells(CrossSection(np.empty((0, 2, 2)), np.empty(0, np.int32)), (4, 4)).any()


def test_ranges_are_expanded_in_order():
    indices, values = expand_ranges(np.array([3, 5, 0]), np.array([5, 5, 2]))
    assert indices.tolist() == [0, 0, 2, 2]
    assert values.tolist() == [3, 4, 0, 1]


@pytest.mark.parametrize("seed", range(5))
def test_thin_slivers_touch_every_cell_they_pass(seed):
    rng = np.random.default_rng(seed)
    (x0, y0), (x1, y1) = rng.uniform(1, 19, (2, 2))
    normal = np.array([y0 - y1, x1 - x0]) / np.hypot(x1 - x0, y1 - y0) * 1e-3
    corners = np.array([(x0, y0), (x1, y1), (x1 + normal[0], y1 + normal[1]), (x0 + normal[0], y0 + normal[1])])
    section = CrossSection(np.stack((corners, np.roll(corners, -1, axis=0)), axis=1), np.zeros(4, np.int32))
    x, y = np.meshgrid(np.arange(20), np.arange(20))
    expected = shapely.intersects(shapely.box(x, y, x + 1, y + 1), shapely.Polygon(corners))
    assert np.array_equal(touched_cells(section, (20, 20)), expected)
