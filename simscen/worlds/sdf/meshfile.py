"""Triangles out of mesh files, in metres, whatever the file claims about itself."""

import io
import logging
from collections.abc import Iterator

import numpy as np

from simscen.worlds.sdf.dae import read_dae
from simscen.worlds.sdf.meshpart import MOST_FACES, Part, UnusableMesh, limit

STL_HEADER, STL_TRIANGLE = 84, 50

# trimesh logs the tracebacks of what it tries first; without any handler Python would print them to stderr.
logging.getLogger("trimesh").addHandler(logging.NullHandler())


def read_parts(data: bytes, suffix: str, file: str) -> tuple[Part, ...]:
    """The parts of a .dae, .stl or .obj file; raises UnusableMesh."""
    readers = {".dae": read_dae, ".stl": _stl, ".obj": _obj}
    if suffix not in readers:
        raise UnusableMesh(f"{suffix or 'files without suffix'} meshes are not read, only DAE, STL and OBJ")
    parts = tuple(part for part in readers[suffix](data, file) if len(part.faces))
    if not parts:
        raise UnusableMesh("the mesh has no triangles")
    _check(parts)
    return tuple(_compact(part) for part in parts)


def _compact(part: Part) -> Part:
    """Without the vertices that no triangle uses: they would shift the middle and the extent."""
    used, faces = np.unique(part.faces, return_inverse=True)
    return Part(part.names, part.vertices[used], faces.reshape(-1, 3))


def _check(parts: tuple[Part, ...]) -> None:
    limit(sum(len(part.faces) for part in parts))
    for part in parts:
        if part.vertices.ndim != 2 or part.vertices.shape[1] != 3:
            raise UnusableMesh("a vertex does not have three coordinates")
        if part.faces.min() < 0 or part.faces.max() >= len(part.vertices):
            raise UnusableMesh("a triangle names a vertex that is not there")
        if not np.isfinite(part.vertices).all():
            raise UnusableMesh("a vertex is not a finite number")


def _stl(data: bytes, _: str) -> Iterator[Part]:
    ascii_file = data[:5] == b"solid" and b"facet" in data[:2000]
    if not ascii_file:
        _check_stl_header(data)
    yield from _trimesh(data, "stl")


def _check_stl_header(data: bytes) -> None:
    """A false count makes PyBullet read past the end of the file."""
    if len(data) < STL_HEADER:
        raise UnusableMesh("too short for an STL file")
    claimed = int.from_bytes(data[80:84], "little")
    held, rest = divmod(len(data) - STL_HEADER, STL_TRIANGLE)
    if claimed != held or rest:
        raise UnusableMesh(f"STL header says {claimed} triangles, file holds {held}")
    limit(claimed)


def _obj(data: bytes, _: str) -> Iterator[Part]:
    if data.count(b"\nf") > MOST_FACES:
        limit(MOST_FACES + 1)
    yield from _trimesh(data, "obj", skip_materials=True, split_objects=True, maintain_order=True)


def _trimesh(data: bytes, kind: str, **options: bool) -> Iterator[Part]:
    import trimesh

    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, **options)
    except Exception as error:  # trimesh lets whatever its parsers meet fall through
        raise UnusableMesh(f"not a readable {kind.upper()} file") from error
    for name, geometry in scene.geometry.items():
        if isinstance(geometry, trimesh.Trimesh):
            named = str(geometry.metadata.get("name") or name)
            yield Part((named,), np.asarray(geometry.vertices, float), np.asarray(geometry.faces, np.int64))
