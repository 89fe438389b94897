"""Tests of shapes in SDF worlds: primitives, planes, polylines, and heightmaps."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from PIL import Image

from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Sphere
from simscen.worlds.geometry.triangulation import triangulate
from simscen.worlds.sdf.shapes import trapezoids

OFF_GRID = 8.28713
"""Offset of a grid of points with steps of 0.5, so that no point lies on a border of a piece."""


def model_with(geometry, pose="", static="<static>1</static>"):
    """Return a model with one collision geometry."""
    return (
        f"<model name='m'>{static}<link name='a'><collision name='c'>\n{pose}<geometry>{geometry}</geometry>"
        "</collision></link></model>"
    )


@pytest.mark.parametrize(
    ("geometry", "shape"),
    [
        ("<box><size>1 2 3</size></box>", Box((1, 2, 3))),
        ("<cylinder><radius>1</radius><length>2</length></cylinder>", Cylinder(1, 2)),
        ("<sphere><radius>1</radius></sphere>", Sphere(1)),
        ("<capsule><radius>1</radius><length>2</length></capsule>", Capsule(1, 2)),
        ("<ellipsoid><radii>1 2 3</radii></ellipsoid>", Ellipsoid((1, 2, 3))),
        ("<cone><radius>1</radius><length>2</length></cone>", Cone(1, 2)),
    ],
)
def test_primitive_shapes_keep_their_sizes(load, geometry, shape):
    assert load(model_with(geometry)).solids[0].shape == shape


@pytest.mark.parametrize(
    ("geometry", "message"),
    [
        ("<box><size>1 2</size></box>", "box/size: expected 3 numbers, got 2"),
        ("<box><size>1 -2 3</size></box>", "box/size: must be positive"),
        ("<box><size>1 nan 3</size></box>", "box/size: must be a finite number"),
        ("<box/>", "box: <size> is missing"),
        ("<sphere><radius>0</radius></sphere>", "sphere/radius: must be positive"),
        ("<sphere><radius>1e5</radius></sphere>", "sphere/radius: larger than 10000 m"),
        ("<cylinder><radius>1_0</radius><length>1</length></cylinder>", "radius: must be a finite number"),
        ("", "geometry: contains no shape"),
        ("<empty/><sphere><radius>1</radius></sphere>", "contains more than one shape: empty, sphere"),
        ("<image><uri>x.png</uri></image>", "<image> is not a shape that is read"),
    ],
)
def test_invalid_sizes_are_errors_at_their_line(refuse, geometry, message):
    (problem,) = refuse(model_with(geometry))
    assert problem.line == 3
    assert message in problem.message


def test_lenient_loading_skips_only_the_invalid_shape(load):
    text = model_with("<box><size>1 1 1</size></box>") + model_with("<box/>").replace("'m'", "'n'")
    world = load(text, lenient=True)
    assert len(world.solids) == 1
    assert world.notes == (
        "shop.world: world[w]/model[n]/link[a]/collision[c]/geometry/box: skipped: <size> is missing",
    )


def plane(normal="0 0 1", size="<size>10 20</size>"):
    return f"<plane><normal>{normal}</normal>{size}</plane>"


BOX = model_with("<box><size>1 1 1</size></box>").replace("'m'", "'n'")


class TestPlanes:
    def test_ground_plane_is_left_to_the_simulator(self, load):
        world = load(model_with(plane()) + BOX)
        assert [solid.name for solid in world.solids] == ["n::a::c"]
        assert not world.notes

    def test_a_level_plane_elsewhere_becomes_a_slab_below_it_with_a_note(self, load):
        (slab,) = load(model_with(plane(), "<pose>1 0 0.5 0 0 0</pose>")).solids
        assert isinstance(slab.shape, Box)
        assert slab.shape.size[:2] == (10, 20)
        assert slab.pose.z + slab.shape.size[2] / 2 == pytest.approx(0.5)
        (note,) = load(model_with(plane(), "<pose>1 0 0.5 0 0 0</pose>")).notes
        assert "level plane at z = 0.5 m" in note

    @pytest.mark.parametrize("normal", ["1 0 0", "0 -1 0", "0 0 -1", "1 2 3", "-1 0 -0.2"])
    def test_other_planes_face_along_their_normal(self, load, normal):
        (slab,) = load(model_with(plane(normal), "<pose>0 0 3 0 0 0</pose>")).solids
        expected = np.array([float(word) for word in normal.split()])
        expected /= np.linalg.norm(expected)
        np.testing.assert_allclose(slab.pose.rotation()[:, 2], expected, atol=1e-9)
        face = slab.pose.apply(np.array([[0, 0, slab.shape.size[2] / 2]]))[0]
        np.testing.assert_allclose(face, [0, 0, 3], atol=1e-12)

    def test_rotated_plane_is_a_wall(self, load):
        assert len(load(model_with(plane(), f"<pose>0 0 0 {math.pi / 2} 0 0</pose>")).solids) == 1

    def test_a_normal_without_length_is_refused(self, refuse):
        assert "the normal has no length" in refuse(model_with(plane("0 0 0")))[0].message


def outline(points, height=2.0):
    return f"<polyline>{''.join(f'<point>{x} {y}</point>' for x, y in points)}<height>{height}</height></polyline>"


SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
HOLE = [(1, 1), (1, 2), (2, 2), (2, 1)]


def union(solids):
    """Return the union of the polygons of the solids."""
    return shapely.unary_union([shapely.Polygon(solid.shape.polygon) for solid in solids])


class TestPolylines:
    def test_one_outline_is_one_solid_in_either_orientation(self, load):
        for points in (SQUARE, SQUARE[::-1], [*SQUARE, SQUARE[0]]):
            (solid,) = load(model_with(outline(points))).solids
            assert isinstance(solid.shape, Extrusion)
            polygon = shapely.Polygon(solid.shape.polygon)
            assert polygon.exterior.is_ccw
            assert polygon.equals(shapely.Polygon(SQUARE))
            assert solid.shape.height == 2

    def test_an_outline_inside_another_is_a_hole(self, load):
        solids = load(model_with(outline(SQUARE) + outline(HOLE))).solids
        assert union(solids).symmetric_difference(shapely.Polygon(SQUARE, [HOLE])).area < 1e-9

    def test_outlines_side_by_side_are_all_filled(self, load):
        distant = [(x + 10, y) for x, y in HOLE]
        assert union(load(model_with(outline(SQUARE) + outline(distant))).solids).area == pytest.approx(17)

    def test_both_loops_of_a_self_intersecting_outline_are_filled(self, load):
        solids = load(model_with(outline([(0, 0), (2, 2), (2, 0), (0, 2)]))).solids
        assert union(solids).area == pytest.approx(2)

    @pytest.mark.parametrize(
        ("polylines", "message"),
        [
            (outline(SQUARE[:2]), "fewer than three points"),
            (outline([(0, 0)] * 4), "fewer than three points"),
            (outline([]), "fewer than three points"),
            (outline(SQUARE, -1), "must be positive"),
            (outline(SQUARE) + outline(HOLE, 1), "different heights"),
            (outline([(k, k * k % 7) for k in range(1200)]), "more than 1000 points"),
        ],
    )
    def test_degenerate_outlines_are_refused(self, refuse, polylines, message):
        assert message in refuse(model_with(polylines))[0].message

    coordinates = st.tuples(st.integers(-8, 8), st.integers(-8, 8))

    @settings(deadline=None)
    @given(st.lists(st.lists(coordinates, min_size=3, max_size=6, unique=True), min_size=1, max_size=3))
    @example([[(-1, 6), (6, -5), (1, 4), (-2, -6)]])
    @example([[(0, 0), (-5, -1), (6, -4)], [(2, -6), (0, 1), (8, 8), (0, 0)], [(0, 0), (0, 1), (3, -4)]])
    def test_trapezoids_cover_the_even_odd_area_of_any_outlines_once(self, outlines):
        pieces = [shapely.Polygon(piece) for piece in trapezoids([np.array(o, float) for o in outlines])]
        assert sum(piece.area for piece in pieces) == pytest.approx(float(even_odd_area(outlines)), abs=1e-6)
        assert all(piece.exterior.is_ccw for piece in pieces)
        borders = shapely.union_all([shapely.LinearRing(outline) for outline in outlines])
        for point in shapely.points(np.indices((34, 34)).reshape(2, -1).T * 0.5 - OFF_GRID):
            if borders.distance(point) > 1e-3:
                inside = sum(piece.contains(point) for piece in pieces)
                assert inside == sum(crossings(outline, point.x, point.y) for outline in outlines) % 2


def crossings(outline, x, y):
    """Return the number of crossings of an outline and the ray along x from a point."""
    edges = zip(outline, [*outline[1:], outline[0]], strict=True)
    return sum((b > y) != (d > y) and x < a + (y - b) * (c - a) / (d - b) for (a, b), (c, d) in edges)


def even_odd_area(outlines):
    """Return the exact area that an odd number of outlines encloses, summed over the slabs between all crossings."""
    edges = [(a, b) for outline in outlines for a, b in zip(outline, [*outline[1:], outline[0]], strict=True)]
    edges = [((Fraction(a), Fraction(b)), (Fraction(c), Fraction(d))) for (a, b), (c, d) in edges if b != d]
    heights = {y for edge in edges for _, y in edge} | {
        y for edge in edges for other in edges for y in crossing_heights(edge, other)
    }
    return sum((top - low) * even_odd_width(edges, (top + low) / 2) for low, top in pairwise(sorted(heights)))


def even_odd_width(edges, y):
    """Return the enclosed width at y. It is linear within a slab, so its mean is the value in the middle."""
    crossings_x = sorted(a + (y - b) * (c - a) / (d - b) for (a, b), (c, d) in edges if (b > y) != (d > y))
    return sum(right - left for left, right in zip(crossings_x[::2], crossings_x[1::2], strict=True))


def crossing_heights(edge, other):
    """Yield the y at which two edges cross, if any."""
    (a, b), (c, d) = edge
    (e, f), (g, h) = other
    determinant = (c - a) * (h - f) - (d - b) * (g - e)
    if determinant != 0 and 0 <= (share := ((e - a) * (h - f) - (f - b) * (g - e)) / determinant) <= 1:
        yield b + share * (d - b)


def heightmap(rest="<size>10 20 3</size>"):
    return f"<heightmap><uri>h.png</uri>{rest}</heightmap>"


class TestHeightmaps:
    def save(self, folder, pixels, mode="L"):
        Image.fromarray(np.array(pixels, np.uint8 if mode == "L" else np.uint16)).save(folder / "h.png")

    def test_white_is_the_maximum_height_and_the_first_row_is_north(self, load, tmp_path):
        self.save(tmp_path, [[0, 50], [0, 0], [100, 0]])
        (solid,) = load(model_with(heightmap())).solids
        assert isinstance(solid.shape, Mesh)
        points = {(x, y): z for x, y, z in solid.shape.vertices.tolist()}
        assert points == {(-5, 10): 0, (5, 10): 1.5, (-5, 0): 0, (5, 0): 0, (-5, -10): 3, (5, -10): 0}

    def test_heightmap_faces_upward_and_covers_its_size(self, load, tmp_path):
        self.save(tmp_path, np.random.default_rng(0).integers(0, 255, (5, 5)))
        mesh = triangulate(load(model_with(heightmap())).solids[0].shape)
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        upward = np.cross(b - a, c - a)[:, 2] / 2
        assert (upward > 0).all()
        assert upward.sum() == pytest.approx(200)

    def test_sixteen_bits_are_read(self, load, tmp_path):
        self.save(tmp_path, [[0, 65535], [32768, 0]], "I;16")
        mesh = load(model_with(heightmap())).solids[0].shape
        assert sorted(mesh.vertices[:, 2]) == pytest.approx([0, 0, 1.5, 3], abs=1e-3)

    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
    def test_tiff_is_read(self, load, tmp_path, dtype):
        Image.fromarray(np.array([[0, 100], [50, 0]], dtype)).save(tmp_path / "h.png", format="TIFF")
        mesh = load(model_with(heightmap())).solids[0].shape
        assert sorted(mesh.vertices[:, 2]) == pytest.approx([0, 0, 1.5, 3])

    @pytest.mark.parametrize("height", [np.nan, -9999.0])
    def test_tiff_with_missing_heights_is_refused(self, refuse, tmp_path, height):
        Image.fromarray(np.array([[0, 1], [height, 0]], np.float32)).save(tmp_path / "h.png", format="TIFF")
        assert "a height is negative or not a number" in refuse(model_with(heightmap()))[0].message

    def test_heightmap_is_moved_by_its_pos(self, load, tmp_path):
        self.save(tmp_path, [[0, 0], [0, 0]])
        (solid,) = load(model_with(heightmap("<size>1 1 1</size><pos>1 2 3</pos>"))).solids
        assert solid.pose.position == (1, 2, 3)

    def test_image_beyond_513_pixels_is_refused_before_it_is_decoded(self, refuse, tmp_path):
        Image.new("L", (3000, 3000)).save(tmp_path / "h.png")
        assert "3000 x 3000 pixels; an edge must have 2 to 513" in refuse(model_with(heightmap()))[0].message

    def test_decompression_bomb_is_refused(self, refuse, tmp_path):
        Image.new("1", (14_000, 14_000)).save(tmp_path / "h.png")
        assert "image too large" in refuse(model_with(heightmap()))[0].message

    def test_file_that_is_not_an_image_is_refused(self, refuse, tmp_path):
        (tmp_path / "h.png").write_bytes(b"GeoTIFF")
        assert "not a readable image" in refuse(model_with(heightmap()))[0].message


def test_masked_collisions_are_noted(load):
    mask = "<surface><contact><collide_bitmask>0x00</collide_bitmask></contact></surface>"
    world = load(model_with("<box><size>1 1 1</size></box>").replace("</collision>", f"{mask}</collision>"))
    assert "still collides with it" in world.notes[0]
