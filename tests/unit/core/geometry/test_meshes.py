"""Tests of the convexity check of meshes."""

import numpy as np
import pytest

from simscen.core.geometry.meshes import CONVEX_TOLERANCE_M, is_convex
from simscen.core.geometry.shapes import Mesh

CORNERS = np.array([(x, y, z) for x in (0.0, 2.0) for y in (0.0, 2.0) for z in (0.0, 2.0)])
FACES = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                  (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)], dtype=np.int32)  # fmt: skip


def cube(offset=(0.0, 0.0, 0.0), height=0.0, scale=1.0):
    """Return a cube with its first corner moved by `offset`, and the middle of one edge raised by `height`, in m."""
    corners = CORNERS * scale
    corners[0] += offset
    middle = (corners[5] + corners[7]) / 2 + (0.0, 0.0, height)
    # The edge from 5 to 7 lies in the faces (4, 7, 5) and (1, 5, 7).
    other_faces = [face for face in FACES.tolist() if face not in ([4, 7, 5], [1, 5, 7])]
    halves = [(4, 7, 8), (4, 8, 5), (1, 5, 8), (1, 8, 7)]
    return Mesh(np.vstack((corners, middle)), np.array([*other_faces, *halves], dtype=np.int32))


@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
def test_cube_of_any_size_is_convex_also_with_a_stretched_corner(scale):
    assert is_convex(cube(scale=scale))
    assert is_convex(Mesh(CORNERS * scale, FACES))
    assert is_convex(Mesh(CORNERS * scale, np.vstack((FACES, [(0, 0, 1)])).astype(np.int32))), "a face without area"


def test_dented_or_inverted_mesh_is_not_convex():
    assert not is_convex(Mesh(CORNERS, FACES[:, ::-1]))
    assert not is_convex(cube(height=-0.1))
    assert not is_convex(cube(offset=(1.5, 1.5, 1.5)))


@pytest.mark.parametrize(("share", "is_convex_mesh"), [(0.4, True), (0.6, False)])
def test_convexity_tolerates_a_micrometer(share, is_convex_mesh):
    # The ends of the edge are twice as far outside of the planes of the dented faces as the dent is deep.
    assert is_convex(cube(height=-share * CONVEX_TOLERANCE_M)) == is_convex_mesh
