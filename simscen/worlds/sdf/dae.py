"""COLLADA files, read with pycollada and not through trimesh, which forgets the unit and the names of nodes."""

import io
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from simscen.assets import markup
from simscen.core.geometry import Array
from simscen.worlds.sdf.meshpart import Part, UnusableMesh, limit
from simscen.worlds.sdf.values import FARTHEST

if TYPE_CHECKING:
    import collada

MOST_NODES = 10_000
LOOKS = {"library_materials", "library_effects", "library_images", "bind_material"}
UNREAD = {"tristrips", "trifans", "convex_mesh", "spline", "instance_controller"}


def read_dae(data: bytes, _: str) -> Iterator[Part]:
    """The parts of a COLLADA scene in metres; raises UnusableMesh."""
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
