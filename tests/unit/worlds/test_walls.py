"""Tests of the solids of walls."""

import numpy as np
import pytest
import shapely

from simscen.core.geometry.shapes import Extrusion
from simscen.worlds.world_file import wall_solids


def footprint(solid):
    assert isinstance(solid.shape, Extrusion)
    return shapely.Polygon(solid.pose.plane.apply(np.array(solid.shape.polygon)))


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0), (4, 0)],
        [(0, 0), (4, 0), (4, 3)],
        [(0, 0), (4, 0), (4, 3), (0, 3), (0, 0)],
        [(0, 0), (2, 0.5), (3, 2), (5, 2.2), (5, 2.2), (4.5, 4)],
    ],
)
def test_wall_is_its_buffered_center_line_with_mitered_corners(points):
    pieces = [footprint(solid) for solid in wall_solids(points, 0.2, 1.0, "w")]
    closed = points[0] == points[-1]
    line = shapely.LinearRing(points) if closed else shapely.LineString(points)
    expected = line.buffer(0.1, cap_style="flat", join_style="mitre")
    union = shapely.union_all(pieces)
    assert union.symmetric_difference(expected).area < 1e-9
    assert sum(piece.area for piece in pieces) == pytest.approx(union.area)  # nothing overlaps
    assert all(piece.exterior.is_ccw for piece in pieces)


def test_sharp_corner_of_a_wall_has_a_limited_miter():
    pieces = [footprint(solid) for solid in wall_solids([(0, 0), (3, 0), (0, 0.5)], 0.2, 1.0, "w")]
    union = shapely.union_all(pieces)
    assert union.bounds[2] == pytest.approx(3.1, abs=0.02)
    assert union.contains(shapely.LineString([(0.1, 0), (3, 0), (0.1, 0.48)]))


@pytest.mark.parametrize("seed", range(20))
def test_wall_segments_shorter_than_the_thickness_keep_shape_and_place(seed):
    points = np.cumsum(np.random.default_rng(seed).uniform(-0.3, 0.3, (12, 2)), axis=0).tolist()
    pieces = [footprint(solid) for solid in wall_solids([(x, y) for x, y in points], 0.3, 1.0, "w")]
    assert all(piece.is_valid and piece.exterior.is_ccw for piece in pieces)
    line = shapely.LineString(points)
    assert shapely.union_all(pieces).buffer(1e-9).covers(line)
    assert line.buffer(0.3 + 1e-9).covers(shapely.union_all(pieces))


def test_wall_of_one_point_gives_no_solids():
    assert wall_solids([(1.0, 1.0), (1.0, 1.0)], 0.1, 1.0, "w") == []
