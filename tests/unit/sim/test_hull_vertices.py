"""Tests of the reduction of convex hulls to fewer vertices."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Body, Cylinder, Mesh, Solid
from simscen.sim.body.outline import HULL_TOLERANCE_M, MAX_UNREDUCED_VERTICES, reduce_hull_vertices


def mesh(surface):
    """Return the mesh of a trimesh object."""
    return Mesh(np.asarray(surface.vertices, float), np.asarray(surface.faces, np.int32))


BALL = mesh(trimesh.creation.icosphere(subdivisions=5, radius=0.3))
ROUND_SHAPES = {
    "ball": BALL,
    "long": Mesh(BALL.vertices * [12.0, 0.4, 0.7], BALL.faces),
    "ring": mesh(trimesh.creation.torus(0.5, 0.1, 64, 64)),
    "tube": mesh(trimesh.creation.cylinder(0.3, 2.0, sections=2000)),
}


@pytest.mark.parametrize("shape", ROUND_SHAPES)
def test_removed_vertices_are_within_a_millimeter_of_the_hull(shape):
    """Brute force: measure the distance of every vertex to each plane of the reduced hull."""
    full = ROUND_SHAPES[shape].vertices
    reduced = reduce_hull_vertices(ROUND_SHAPES[shape])
    assert len(reduced) < len(ConvexHull(full).vertices) / 2
    assert reduce_hull_vertices(ROUND_SHAPES[shape]) is reduced
    planes = ConvexHull(reduced).equations
    assert max((planes[:, :3] @ point + planes[:, 3]).max() for point in full) <= HULL_TOLERANCE_M + 1e-9
    rows = {tuple(row) for row in full.tolist()}
    assert all(tuple(row) in rows for row in reduced.tolist())


def test_hull_with_few_corners_keeps_its_volume():
    box = trimesh.creation.box((1, 2, 3)).subdivide().subdivide().subdivide()
    assert len(box.vertices) > MAX_UNREDUCED_VERTICES
    assert ConvexHull(reduce_hull_vertices(mesh(box))).volume == pytest.approx(6.0)
    assert len(reduce_hull_vertices(mesh(box))) < 100


def test_flat_point_set_is_not_reduced():
    flat = Mesh(BALL.vertices * [1, 1, 0], BALL.faces)
    assert reduce_hull_vertices(flat) is flat.vertices


def test_object_with_80_000_faces_can_be_pushed_and_rendered(simulate):
    """Bullet's commands accept at most 131 072 vertices, and its renderer needs three for each face."""
    fine = mesh(trimesh.creation.cylinder(0.3, 0.6, sections=20_000))
    clearances = []
    for shape in (Cylinder(0.3, 0.6), fine):
        simulation = simulate(bodies=[Body("drum", (Solid(shape, Pose3(z=0.3), "drum"),), Pose3(1.5), 2.0)])
        simulation.step(24)
        clearances.append(simulation.truth().clearance)
    assert clearances[1] == pytest.approx(clearances[0], abs=2e-3)
    _, depth = simulation.robot.image(Pose3(z=0.3), 32, 24, 1.0, 10.0)
    assert depth[12, 16] == pytest.approx(1.2, abs=0.02)
