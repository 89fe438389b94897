"""Tests of mass, center of mass, and inertia of shapes."""

import math

import numpy as np
import pytest
import trimesh

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Solid, Sphere
from simscen.sim.body.inertia import MassProperties, combine, inertia_of_shape, inertia_of_solids, volume
from simscen.worlds.geometry.triangulation import triangulate

SHAPES = [
    Box((0.4, 0.3, 0.2)),
    Cylinder(0.2, 0.5),
    Sphere(0.3),
    Capsule(0.1, 0.4),
    Ellipsoid((0.1, 0.2, 0.3)),
    Cone(0.2, 0.6),
    Extrusion(((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)), 0.5),
]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_mass_properties_equal_those_of_trimesh(shape):
    surface = triangulate(shape)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    mesh.density = 3.0 / mesh.volume
    ours = inertia_of_shape(shape, 3.0)
    assert volume(shape) == pytest.approx(mesh.volume, rel=0.01)
    assert ours.center == pytest.approx(mesh.center_mass, abs=1e-3)
    assert ours.tensor == pytest.approx(mesh.moment_inertia, rel=0.01, abs=1e-3)


def test_inertia_of_two_halves_equals_that_of_the_whole_box():
    halves = [Solid(Box((0.2, 0.3, 0.1)), Pose3(x=side)) for side in (-0.1, 0.1)]
    whole = inertia_of_shape(Box((0.4, 0.3, 0.1)), 2.0)
    ours = inertia_of_solids(halves, 2.0)
    assert ours.center == pytest.approx(whole.center)
    assert ours.tensor == pytest.approx(whole.tensor)


def test_inertia_of_a_flat_mesh_equals_that_of_a_sheet():
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    sheet = Solid(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32)))
    ours = inertia_of_solids([sheet], 12.0)
    assert ours.center == pytest.approx((1.0, 0.5, 0.0))
    assert np.diag(ours.tensor) == pytest.approx((1.0, 4.0, 5.0))


def test_principal_moments_do_not_change_with_rotation():
    box = inertia_of_shape(Box((0.4, 0.3, 0.1)), 2.0)
    moments, frame = box.transformed(Pose3.from_rpy(1, 2, 3, 0.3, -0.2, 0.9)).principal()
    assert sorted(moments) == pytest.approx(sorted(np.diag(box.tensor)))
    assert frame.position == pytest.approx((1, 2, 3))
    turn = frame.rotation()
    back = turn @ np.diag(moments) @ turn.T
    assert back == pytest.approx(box.transformed(Pose3.from_rpy(0, 0, 0, 0.3, -0.2, 0.9)).tensor)
    assert math.isclose(np.linalg.det(turn), 1.0)


def test_massless_parts_do_not_change_the_inertia():
    box = inertia_of_shape(Box((0.4, 0.3, 0.1)), 2.0)
    massless = MassProperties(0.0, np.array([5.0, 0.0, 0.0]), np.zeros((3, 3)))
    assert combine([box, massless]).tensor == pytest.approx(box.tensor)
