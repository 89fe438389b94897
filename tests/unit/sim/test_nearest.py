import numpy as np
import pytest
import trimesh
from playground import box

from simscen.core.geometry import Pose3
from simscen.core.shapes import Cylinder, Solid
from simscen.sim.nearest import Owners, point_to_triangles
from simscen.worlds.meshing import fuse


def test_distances_to_triangles_are_trimeshs():
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(300, 3, 3))
    point = rng.normal(size=3)
    closest = trimesh.triangles.closest_point(corners, np.tile(point, (300, 1)))
    assert point_to_triangles(point, corners) == pytest.approx(np.linalg.norm(closest - point, axis=1))


def test_a_triangle_without_area_is_as_far_as_its_edges():
    flat = np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]])
    assert point_to_triangles(np.array([1.5, 2.0, 0.0]), flat) == pytest.approx([2.0])


def test_the_owner_is_the_solid_whose_surface_is_nearest():
    owners = Owners(fuse([box("shelf", 0, 0, 2, 2), Solid(Cylinder(0.3, 1), Pose3(3, 0, 0.5), "post")]))
    assert owners.name((1.01, 0.5, 0.2)) == "shelf"
    assert owners.name((2.71, 0.0, 0.2)) == "post"
    assert owners.name((50.0, 0.0, 0.2)) == ""
