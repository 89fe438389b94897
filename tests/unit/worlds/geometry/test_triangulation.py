"""Tests of triangle meshes of shapes, and of the merged mesh of several solids."""

import math

import numpy as np
import pytest
import trimesh

from simscen.core.geometry import Pose3
from simscen.core.geometry.meshes import MAX_CONVEX_FACES, is_convex, submesh
from simscen.core.geometry.shapes import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Ellipsoid,
    Extrusion,
    Mesh,
    Solid,
    Sphere,
    facet_count,
)
from simscen.worlds.geometry.triangulation import merge_solids, triangulate

L_SHAPE = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))
VOLUMES = [
    (Box((1.0, 2.0, 3.0)), 6.0),
    (Cylinder(0.5, 2.0), math.pi * 0.25 * 2),
    (Sphere(0.7), 4 / 3 * math.pi * 0.7**3),
    (Capsule(0.3, 1.0), math.pi * 0.09 + 4 / 3 * math.pi * 0.027),
    (Capsule(0.3, 0.0), 4 / 3 * math.pi * 0.027),
    (Ellipsoid((0.5, 1.0, 0.2)), 4 / 3 * math.pi * 0.1),
    (Cone(0.5, 1.5), math.pi * 0.25 * 0.5),
    (Extrusion(L_SHAPE, 0.5), 2.0),
    (Extrusion(L_SHAPE[::-1], 0.5), 2.0),
]


@pytest.mark.parametrize(("shape", "volume"), VOLUMES, ids=lambda value: type(value).__name__)
def test_every_shape_is_a_closed_surface_with_outward_normals_and_the_right_volume(shape, volume):
    mesh = triangulate(shape)
    reference = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert reference.is_watertight
    assert reference.is_winding_consistent
    assert reference.volume == pytest.approx(volume, rel=0.004)
    assert reference.volume <= volume + 1e-9


@pytest.mark.parametrize("radius", [0.05, 0.2, 0.5, 1.0, 2.0])
def test_facets_stay_within_a_millimeter_of_the_circle(radius):
    assert radius * (1 - math.cos(math.pi / facet_count(radius))) <= 0.001
    ball = triangulate(Sphere(radius))
    centers = ball.vertices[ball.faces].mean(axis=1)
    assert np.abs(np.linalg.norm(centers, axis=1) - radius).max() < 0.001


def test_extents_of_round_shapes_are_exact():
    mesh = triangulate(Cylinder(0.37, 2.0))
    assert np.allclose(mesh.vertices.max(axis=0), [0.37, 0.37, 1.0], atol=1e-12)
    assert np.allclose(mesh.vertices.min(axis=0), [-0.37, -0.37, -1.0], atol=1e-12)


def test_merged_mesh_has_all_solids_and_the_owner_of_each_face():
    pose = Pose3.from_rpy(5, 0, 0.5, 0, 0, math.pi / 2)
    mesh = merge_solids([Solid(Box((2.0, 1.0, 1.0)), pose, "a"), Solid(Cylinder(0.2, 1.0), Pose3(x=-3), "b")])
    box = mesh.vertices[mesh.faces[mesh.owners == 0]].reshape(-1, 3)
    assert np.allclose(box.min(axis=0), [4.5, -1, 0])
    assert np.allclose(box.max(axis=0), [5.5, 1, 1])
    post = mesh.vertices[mesh.faces[mesh.owners == 1]].reshape(-1, 3)
    assert np.allclose(post[:, 0].max(), -2.8)
    assert mesh.names == ("a", "b")


def test_convex_shapes_are_their_own_hulls():
    quad, dent = ((0, 0), (2, 0), (2.2, 1), (0, 0.9)), ((0, 0), (2, 0), (0.5, 0.5), (0, 2))
    shapes = [*(shape for shape, _ in VOLUMES), Extrusion(quad, 1.0), Extrusion(dent, 1.0), triangulate(Box((1, 1, 1)))]
    rng = np.random.default_rng(2)
    poses = [Pose3.from_rpy(*rng.uniform(-50, 50, 3), *rng.uniform(-3, 3, 3)) for _ in shapes]
    mesh = merge_solids([Solid(shape, pose) for shape, pose in zip(shapes, poses, strict=True)])
    found = [hull is not None for hull in mesh.hulls]
    assert found == [True, True, False, False, False, False, True, False, False, True, False, False]
    assert {len(triangulate(shape).faces) > MAX_CONVEX_FACES for shape, _ in VOLUMES[2:6]} == {True}
    for owner, hull in enumerate(mesh.hulls):
        solid = submesh(mesh.vertices, mesh.faces[mesh.owners == owner])
        if hull is not None:
            assert np.array_equal(mesh.vertices[hull], solid.vertices)
            assert is_convex(solid)
            reference = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
            assert reference.convex_hull.volume == pytest.approx(reference.volume, rel=1e-9)


def test_no_solids_merge_to_an_empty_mesh():
    mesh = merge_solids([])
    assert mesh.vertices.shape == (0, 3)
    assert mesh.faces.shape == (0, 3)


def test_mesh_is_returned_unchanged():
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]], dtype=np.int32))
    assert triangulate(mesh) is mesh
