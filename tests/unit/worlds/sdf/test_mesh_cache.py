"""Tests of the cache of mesh files."""

import numpy as np
import pytest

from simscen.worlds.sdf.mesh_files import UnusableMesh
from simscen.worlds.sdf.meshes import MeshCache

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
OTHER_TRIANGLE = b"v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n"


def test_equal_content_is_parsed_once():
    cache = MeshCache()
    assert cache.read(TRIANGLE, ".obj") is cache.read(TRIANGLE, ".obj")


def test_different_content_is_a_different_mesh():
    cache = MeshCache()
    first, second = cache.read(TRIANGLE, ".obj"), cache.read(OTHER_TRIANGLE, ".obj")
    assert np.ptp(first[0].vertices[:, 0]) == 1.0
    assert np.ptp(second[0].vertices[:, 0]) == 2.0


def test_the_least_recently_used_mesh_is_dropped_first():
    cache = MeshCache(max_bytes=1)
    first = cache.read(TRIANGLE, ".obj")
    cache.read(OTHER_TRIANGLE, ".obj")
    assert cache.read(TRIANGLE, ".obj") is not first


def test_a_broken_mesh_is_refused_each_time():
    cache = MeshCache()
    for _ in range(2):
        with pytest.raises(UnusableMesh):
            cache.read(b"v 0 0", ".obj")
