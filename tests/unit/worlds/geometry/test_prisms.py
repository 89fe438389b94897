"""Tests of upright prisms, which give distances and extents without a triangle mesh."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Cone, Cylinder, Extrusion, Solid, Sphere
from simscen.worlds.geometry.mesh_overlaps import horizontal_distance
from simscen.worlds.geometry.prisms import bounding_rectangle, upright_prism
from simscen.worlds.geometry.triangulation import merge_solids, triangulate

L_SHAPE = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))
STAR = tuple((math.cos(4 * math.pi * k / 5), math.sin(4 * math.pi * k / 5)) for k in range(5))

sizes = st.floats(0.01, 3.0)
coordinates = st.floats(-3.0, 3.0)
heights = st.floats(-1.0, 1.0)
headings = st.floats(-math.pi, math.pi)
poses = st.builds(
    lambda x, y, z, yaw: Pose3.planar(Pose2(x, y, yaw), z), coordinates, coordinates, st.floats(-1.0, 1.0), headings
)
quadrangles = st.builds(
    lambda a, b, c, d, h: Extrusion(((a, 0.0), (0.0, b), (-c, 0.0), (0.0, -d)), h), sizes, sizes, sizes, sizes, sizes
)
shapes = st.one_of(
    st.builds(lambda x, y, z: Box((x, y, z)), sizes, sizes, sizes),
    st.builds(Cylinder, sizes, sizes),
    quadrangles,
    quadrangles.map(lambda quadrangle: Extrusion(quadrangle.polygon[::-1], quadrangle.height)),
)


@given(shape=shapes, pose=poses, point=st.tuples(coordinates, coordinates))
def test_distances_are_those_of_the_triangle_mesh(shape, pose, point):
    solid, slab = Solid(shape, pose), (0.02, 0.4)
    prism = upright_prism(solid)
    assert prism is not None
    assert prism.distance(point, slab) == pytest.approx(
        horizontal_distance(merge_solids([solid]), point, slab), abs=1e-9
    )


def mesh_rectangle(solid, frame=None):
    """Return the bounding rectangle of the triangles of a solid."""
    return bounding_rectangle(Solid(triangulate(solid.shape), solid.pose), frame)


@given(shape=shapes, pose=poses, frame=poses)
def test_extents_are_those_of_the_triangle_mesh(shape, pose, frame):
    solid = Solid(shape, pose)
    for reference in (None, frame):
        assert upright_prism(solid, reference) is not None
        assert bounding_rectangle(solid, reference) == pytest.approx(mesh_rectangle(solid, reference), abs=1e-9)


@pytest.mark.parametrize(
    "solid",
    [
        Solid(Box((1, 1, 1)), Pose3.from_rpy(0, 0, 0, 0.1, 0, 0)),
        Solid(Sphere(1.0)),
        Solid(Cone(1.0, 1.0)),
        Solid(Extrusion(L_SHAPE, 1.0)),
        Solid(Extrusion(STAR, 1.0)),
        Solid(Extrusion(((0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (0.0, 1.0)), 1.0)),
    ],
    ids=["tilted", "ball", "cone", "concave", "star", "duplicate corner"],
)
def test_other_solids_use_the_mesh(solid):
    assert upright_prism(solid) is None
    assert bounding_rectangle(solid) == pytest.approx(mesh_rectangle(solid))


def test_solid_in_a_tilted_frame_uses_the_mesh():
    assert upright_prism(Solid(Box((1, 1, 1))), Pose3.from_rpy(0, 0, 0, 0, 0.2, 0)) is None


def test_solid_that_only_touches_the_height_range_is_ignored():
    box = upright_prism(Solid(Box((1, 1, 1)), Pose3(z=0.5)))
    assert box is not None
    assert box.distance((0, 0), (1.0, 2.0)) == box.distance((0, 0), (-1.0, 0.0)) == math.inf
    assert box.distance((0, 0), (np.nextafter(1.0, 0.0), 2.0)) == 0.0


def test_rectangles_of_meshes_follow_the_pose_of_solid_and_frame():
    solid = Solid(Box((2.0, 1.0, 1.0)), Pose3(x=1.0))
    assert mesh_rectangle(solid) == pytest.approx((0, -0.5, 2, 0.5))
    frame = Pose3.from_rpy(10, 0, 0, 0, 0, math.pi / 2)
    assert mesh_rectangle(solid, frame) == pytest.approx((9.5, 0, 10.5, 2))
