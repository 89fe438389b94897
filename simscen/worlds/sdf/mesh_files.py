"""Readers of DAE, STL and OBJ mesh files; all return parts in meters.

COLLADA is read with pycollada, because trimesh drops the unit and the node names.
"""

import io
import logging
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from simscen.assets import markup
from simscen.core.geometry import Array
from simscen.worlds.sdf.values import FARTHEST

if TYPE_CHECKING:
    import collada

MOST_FACES = 1_000_000


class UnusableMesh(Exception):
    """Why a mesh file cannot be used."""


@dataclass(frozen=True, eq=False)
class Part:
    """A named part of a mesh: `vertices` (n, 3) in meters, `faces` (m, 3); `names` is what a submesh may call it."""

    names: tuple[str, ...]
    vertices: Array
    faces: npt.NDArray[np.int64]


def limit(faces: int) -> None:
    """Raise UnusableMesh when there are too many triangles."""
    if faces > MOST_FACES:
        raise UnusableMesh(f"more than {MOST_FACES} triangles")


MOST_NODES = 10_000
LOOKS = {"library_materials", "library_effects", "library_images", "bind_material"}
UNREAD = {"tristrips", "trifans", "convex_mesh", "spline", "instance_controller"}


def read_dae(data: bytes, _: str) -> Iterator[Part]:
    """The parts of a COLLADA scene in meters; raises UnusableMesh."""
    import collada

    try:
        markup.refuse_doctype(data)
    except markup.Broken as error:
        raise UnusableMesh(f"line {error.line}: {error.message}") from error
    try:
        bare = _without_looks(data)
        document = collada.Collada(io.BytesIO(bare), ignore=[collada.DaeError])
        unit = float(document.assetInfo.unitmeter or 1.0)
        nodes = document.scene.nodes if document.scene else []
        _check_complete(document)
        parts = list(_nodes(nodes, np.eye(4), ""))
    except UnusableMesh:
        raise
    except Exception as error:  # pycollada raises what its XML and array code happen to meet
        raise UnusableMesh("not a readable COLLADA file") from error
    if not 0 < unit < FARTHEST:
        raise UnusableMesh(f"a unit of {unit:g} m")
    for part in parts:
        yield Part(part.names, part.vertices * unit, part.faces)


def _without_looks(data: bytes) -> bytes:
    """The file without materials: pycollada would drop every geometry whose material or image is missing."""
    root = ET.fromstring(data)
    for parent in list(root.iter()):
        for child in [child for child in parent if _kind(child) in LOOKS]:
            parent.remove(child)
    return ET.tostring(root)


def _check_complete(document: "collada.Collada") -> None:
    """pycollada leaves out what it cannot read without a word; raises UnusableMesh when that is geometry."""
    known = {geometry.id for geometry in document.geometries}
    for element in document.xmlnode.getroot().iter():
        name = element.get("url", "").removeprefix("#")
        if _kind(element) == "instance_geometry" and name not in known:
            raise UnusableMesh(f"its geometry {name[:80]!r} is missing or cannot be read")
        if _kind(element) in UNREAD:
            raise UnusableMesh(f"<{_kind(element)}> is not read, only triangles, polylists and polygons")


def _kind(element: "ET.Element") -> str:
    return str(element.tag).rpartition("}")[2]


def _nodes(nodes: list[object], matrix: Array, name: str) -> Iterator[Part]:
    """The parts of a COLLADA scene, in its own unit; a part is called after the nearest named node above it."""
    from collada.scene import GeometryNode, Node

    waiting = [(node, matrix, name) for node in reversed(nodes)]
    visited = faces = 0
    while waiting:
        node, parent, called = waiting.pop()
        visited += 1
        if visited > MOST_NODES:
            raise UnusableMesh(f"more than {MOST_NODES} nodes")
        if isinstance(node, GeometryNode):
            for part in _primitives(node.geometry, parent, called):
                faces += len(part.faces)
                limit(faces)
                yield part
        elif isinstance(node, Node):
            own = node.xmlnode.get("name") or called
            placed = parent @ np.asarray(node.matrix, float)
            waiting.extend((child, placed, own) for child in reversed(node.children or []))


def _primitives(geometry: object, matrix: Array, called: str) -> Iterator[Part]:
    names = tuple(name for name in (called, geometry.name, geometry.id) if name)  # type: ignore[attr-defined]
    for primitive in geometry.primitives:  # type: ignore[attr-defined]
        triangles = primitive.triangleset() if hasattr(primitive, "triangleset") else primitive
        if getattr(triangles, "vertex", None) is None or not hasattr(triangles, "ntriangles"):
            continue  # lines, or an empty primitive
        vertices = np.asarray(triangles.vertex, float) @ matrix[:3, :3].T + matrix[:3, 3]
        faces = np.asarray(triangles.vertex_index, np.int64).reshape(-1, 3)
        flip = np.linalg.det(matrix[:3, :3]) < 0
        yield Part(names, vertices, faces[:, ::-1] if flip else faces)


STL_HEADER, STL_TRIANGLE = 84, 50

# trimesh logs the tracebacks of what it tries first; without any handler Python would print them to stderr.
logging.getLogger("trimesh").addHandler(logging.NullHandler())


def read_parts(data: bytes, suffix: str, file: str) -> tuple[Part, ...]:
    """The parts of a .dae, .stl or .obj file; raises UnusableMesh."""
    readers = {".dae": read_dae, ".stl": _stl, ".obj": _obj}
    if suffix not in readers:
        raise UnusableMesh(f"{suffix or 'files without suffix'} meshes are not read, only DAE, STL and OBJ")
    # Broken numbers are refused below with a message; NumPy's and trimesh's warnings would only reach the terminal.
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore", RuntimeWarning)
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
