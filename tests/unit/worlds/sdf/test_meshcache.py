import warnings
from collections.abc import Iterator

import numpy as np
import pytest

from simscen.worlds.sdf import mesh_files
from simscen.worlds.sdf.mesh_files import UnusableMesh
from simscen.worlds.sdf.meshcache import MeshCache

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
OTHER = b"v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n"


def test_equal_content_is_read_once_whatever_the_file_is_called():
    cache = MeshCache()
    assert cache.read(TRIANGLE, ".obj", "a.obj") is cache.read(TRIANGLE, ".obj", "b.obj")


def test_other_content_is_another_mesh():
    cache = MeshCache()
    one, other = cache.read(TRIANGLE, ".obj", "a.obj"), cache.read(OTHER, ".obj", "a.obj")
    assert np.ptp(one[0].vertices[:, 0]) == 1.0
    assert np.ptp(other[0].vertices[:, 0]) == 2.0


def test_the_mesh_asked_for_longest_ago_goes_first():
    cache = MeshCache(most_bytes=1)
    first = cache.read(TRIANGLE, ".obj", "a.obj")
    cache.read(OTHER, ".obj", "b.obj")
    assert cache.read(TRIANGLE, ".obj", "a.obj") is not first


def test_a_broken_mesh_is_refused_each_time_by_the_name_it_has():
    cache = MeshCache()
    for name in ("a.obj", "b.obj"):
        with pytest.raises(UnusableMesh):
            cache.read(b"v 0 0", ".obj", name)


def test_warnings_of_the_readers_do_not_reach_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    def overflowing(data: bytes, _: str) -> Iterator[mesh_files.Part]:
        corners = np.array([[1e308, 0, 0], [0, 1, 0], [0, 0, 1]]) * 10
        warnings.warn("invalid value encountered in divide", RuntimeWarning, stacklevel=1)
        yield mesh_files.Part((), corners, np.array([[0, 1, 2]]))

    monkeypatch.setattr(mesh_files, "_stl", overflowing)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(mesh_files.UnusableMesh, match="not a finite number"):
            mesh_files.read_parts(b"", ".stl", "x.stl")
