"""Tests of the tiles of large meshes, and of meshes of some faces."""

import numpy as np
import pytest

from simscen.core.geometry.meshes import submesh, tile_faces


def floor_mesh(edge: int):
    """Return vertices and faces of a square floor of `edge` m, with two triangles in each square meter."""
    x, y = np.meshgrid(np.arange(edge + 1.0), np.arange(edge + 1.0))
    vertices = np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size)))
    first = (np.arange(edge)[:, None] * (edge + 1) + np.arange(edge)).ravel()
    lower = np.column_stack((first, first + 1, first + edge + 1))
    return vertices, np.concatenate((lower, lower + np.array((1, edge + 1, 0)))).astype(np.int32)


def test_tiles_near_a_point_contain_all_near_faces_and_few_others():
    vertices, faces = floor_mesh(40)
    tiles = tile_faces(vertices, faces, 4.0)
    near_tiles = tiles.near(10.5, 20.0, 9.0)
    selected = {tuple(face) for number in np.flatnonzero(near_tiles) for face in tiles.tile(number).tolist()}
    inside = np.hypot(*(vertices[faces, :2] - (10.5, 20.0)).transpose(2, 0, 1)).min(axis=1) <= 9.0
    assert {tuple(face) for face in faces[inside].tolist()} <= selected
    assert len(selected) < 2 * 22 * 22


@pytest.mark.parametrize("count", [3, 1000])
def test_submesh_contains_only_its_vertices_in_mesh_order(count):
    vertices, faces = floor_mesh(40)
    selected = np.random.default_rng(3).permutation(faces)[:count]
    part = submesh(vertices, selected)
    assert np.array_equal(part.vertices[part.faces], vertices[selected])
    assert np.array_equal(part.vertices, vertices[np.unique(selected)])
    assert part.faces.dtype == np.int32
