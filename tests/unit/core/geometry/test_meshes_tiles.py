import numpy as np
import pytest

from simscen.core.geometry.meshes import submesh, tile_faces


def grid(edge: int):
    """Two triangles in each square meter of a floor."""
    x, y = np.meshgrid(np.arange(edge + 1.0), np.arange(edge + 1.0))
    vertices = np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size)))
    first = (np.arange(edge)[:, None] * (edge + 1) + np.arange(edge)).ravel()
    lower = np.column_stack((first, first + 1, first + edge + 1))
    return vertices, np.concatenate((lower, lower + np.array((1, edge + 1, 0)))).astype(np.int32)


def test_blocks_near_a_point_contain_all_near_faces_and_no_far_corner():
    vertices, faces = grid(40)
    lots = tile_faces(vertices, faces, 4.0)
    near = lots.near(10.5, 20.0, 9.0)
    taken = {tuple(face) for number in np.flatnonzero(near) for face in lots.tile(number).tolist()}
    inside = np.hypot(*(vertices[faces, :2] - (10.5, 20.0)).transpose(2, 0, 1)).min(axis=1) <= 9.0
    assert {tuple(face) for face in faces[inside].tolist()} <= taken
    assert len(taken) < 2 * 22 * 22


@pytest.mark.parametrize("count", [3, 1000])
def test_submesh_contains_only_its_vertices_in_mesh_order(count):
    vertices, faces = grid(40)
    some = np.random.default_rng(3).permutation(faces)[:count]
    part = submesh(vertices, some)
    assert np.array_equal(part.vertices[part.faces], vertices[some])
    assert np.array_equal(part.vertices, vertices[np.unique(some)])
    assert part.faces.dtype == np.int32
