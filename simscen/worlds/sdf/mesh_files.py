"""Parse COLLADA (DAE), STL and OBJ mesh files into named parts with vertices in m.

COLLADA is parsed by pycollada, because trimesh drops the unit and the node names. STL and OBJ are parsed by trimesh.
"""

import codecs
import io
import logging
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from simscen.assets import markup
from simscen.core.geometry import Array
from simscen.worlds.sdf.elements import MAX_COORDINATE_M

if TYPE_CHECKING:
    import collada

MAX_FACES = 1_000_000
"""Maximum number of triangles of a file."""
MAX_NODES = 10_000
"""Maximum number of nodes of a COLLADA scene, including repeated instances of a node."""
STL_HEADER_BYTES, STL_TRIANGLE_BYTES = 84, 50
"""Size of the header and of each triangle of a binary STL file."""
MATERIAL_ELEMENTS = {"library_materials", "library_effects", "library_images", "bind_material"}
"""COLLADA elements that are removed before pycollada reads a file."""
INSTANCE_ELEMENTS = {"instance_geometry", "instance_controller", "instance_node"}
"""COLLADA elements that add geometry to a scene node."""
UNSUPPORTED_ELEMENTS = {"tristrips", "trifans", "convex_mesh", "spline", "instance_controller"}
"""COLLADA geometry that is an error, because it cannot be read."""

# trimesh logs tracebacks of formats that it tries; without any handler, Python would print them to stderr.
logging.getLogger("trimesh").addHandler(logging.NullHandler())


class UnusableMesh(Exception):
    """A mesh file cannot be used; the message is the reason."""


@dataclass(frozen=True, eq=False)
class MeshPart:
    """A part of a mesh: `vertices` (n, 3) in m, `faces` (m, 3), and the names by which `<submesh>` finds the part."""

    names: tuple[str, ...]
    vertices: Array
    faces: npt.NDArray[np.int64]


def read_parts(data: bytes, suffix: str) -> tuple[MeshPart, ...]:
    """Return the parts in the content of a file with the suffix .dae, .stl or .obj. Raises UnusableMesh."""
    readers = {".dae": _read_dae, ".stl": _read_stl, ".obj": _read_obj}
    if suffix not in readers:
        raise UnusableMesh(f"{suffix or 'files without suffix'} meshes are not read, only DAE, STL and OBJ")
    parts = tuple(part for part in readers[suffix](data) if len(part.faces))
    if not parts:
        raise UnusableMesh("the mesh has no triangles")
    _check_parts(parts)
    without_unused_vertices = []
    for part in parts:
        vertex_indices, faces = np.unique(part.faces, return_inverse=True)
        without_unused_vertices.append(MeshPart(part.names, part.vertices[vertex_indices], faces.reshape(-1, 3)))
    return tuple(without_unused_vertices)


def _check_parts(parts: tuple[MeshPart, ...]) -> None:
    """Raise UnusableMesh if a vertex or a triangle of the parts is invalid, or if there are too many triangles."""
    _check_face_count(sum(len(part.faces) for part in parts))
    for part in parts:
        if part.vertices.ndim != 2 or part.vertices.shape[1] != 3:
            raise UnusableMesh("a vertex does not have three coordinates")
        if part.faces.min() < 0 or part.faces.max() >= len(part.vertices):
            raise UnusableMesh("a triangle refers to a vertex that does not exist")
        if not np.isfinite(part.vertices).all():
            raise UnusableMesh("a vertex is not a finite number")


def _check_face_count(count: int) -> None:
    if count > MAX_FACES:
        raise UnusableMesh(f"more than {MAX_FACES} triangles")


def _read_stl(data: bytes) -> Iterator[MeshPart]:
    from trimesh.exchange.stl import load_stl

    text = data.removeprefix(codecs.BOM_UTF8).lstrip().lower()
    is_ascii = text.startswith(b"solid") and b"facet" in text[:2000]
    if not is_ascii:
        _check_stl_header(data)
    yield from _parts_from_trimesh(lambda: load_stl(io.BytesIO(data)), "STL")


def _check_stl_header(data: bytes) -> None:
    """Raise UnusableMesh if the number of triangles does not match the file size of a binary STL."""
    if len(data) < STL_HEADER_BYTES:
        raise UnusableMesh("too short for an STL file")
    stated = int.from_bytes(data[80:84], "little")
    count, excess_bytes = divmod(len(data) - STL_HEADER_BYTES, STL_TRIANGLE_BYTES)
    if stated != count or excess_bytes:
        raise UnusableMesh(f"STL header says {stated} triangles, file holds {count}")
    _check_face_count(stated)


def _read_obj(data: bytes) -> Iterator[MeshPart]:
    from trimesh.exchange.obj import load_obj

    _check_face_count(data.count(b"\nf"))
    options = {"skip_materials": True, "split_objects": True, "maintain_order": True}
    yield from _parts_from_trimesh(lambda: load_obj(io.BytesIO(data), **options), "OBJ")


def _parts_from_trimesh(load: Callable[[], Mapping[str, Any]], file_format: str) -> Iterator[MeshPart]:
    """Call `load`, a loader of trimesh, and yield the parts in its result (keyword arguments of a Trimesh or Scene)."""
    from trimesh.geometry import triangulate_quads

    try:
        with warnings.catch_warnings():  # NumPy warns about texture coordinates, which are not used
            warnings.simplefilter("ignore", RuntimeWarning)
            loaded = load()
        geometries: Mapping[str, Any] = loaded.get("geometry", {"": loaded})
        parts = [
            MeshPart((name,) if name else (), np.asarray(mesh["vertices"], float), triangulate_quads(mesh["faces"]))
            for name, mesh in geometries.items()
            if "faces" in mesh
        ]
    except Exception as error:  # trimesh passes on all exceptions of its parsers
        raise UnusableMesh(f"not a readable {file_format} file") from error
    yield from parts


def _read_dae(data: bytes) -> Iterator[MeshPart]:
    import collada

    try:
        markup.refuse_doctype(data)
    except markup.MalformedXml as error:
        raise UnusableMesh(f"line {error.line}: {error.message}") from error
    try:
        # Infinite or huge numbers in transformations raise FloatingPointError instead of a warning.
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            document = collada.Collada(io.BytesIO(_geometry_only(data)), ignore=[collada.DaeError])
            meters_per_unit = float(document.assetInfo.unitmeter or 1.0)
            nodes = document.scene.nodes if document.scene else []
            _check_complete(document)
            parts = list(_parts_of_nodes(nodes))
    except UnusableMesh:
        raise
    except FloatingPointError as error:
        raise UnusableMesh("a vertex or a transformation is not a finite number") from error
    except Exception as error:  # pycollada passes on all exceptions of its XML and array code
        raise UnusableMesh("not a readable COLLADA file") from error
    if not 0 < meters_per_unit < MAX_COORDINATE_M:
        raise UnusableMesh(f"a unit of {meters_per_unit:g} m")
    for part in parts:
        yield MeshPart(part.names, part.vertices * meters_per_unit, part.faces)


def _geometry_only(data: bytes) -> bytes:
    """Return the content of a COLLADA file without materials and without scene nodes that have no geometry.

    pycollada would drop geometry with missing materials or images. Lights and cameras often have invalid matrices.
    """
    root = ET.fromstring(data)
    elements_with_geometry: set[ET.Element] = set()
    for parent in reversed(list(root.iter())):  # children come before their parents
        is_in_scene = _local_name(parent) in ("visual_scene", "node")
        for child in list(parent):
            is_empty_node = is_in_scene and _local_name(child) == "node" and child not in elements_with_geometry
            if _local_name(child) in MATERIAL_ELEMENTS or is_empty_node:
                parent.remove(child)
        if _local_name(parent) in INSTANCE_ELEMENTS or any(child in elements_with_geometry for child in parent):
            elements_with_geometry.add(parent)
    return ET.tostring(root)


def _check_complete(document: "collada.Collada") -> None:
    """Raise UnusableMesh if the file has geometry that pycollada silently left out because it cannot read it."""
    known = {geometry.id for geometry in document.geometries}
    for element in document.xmlnode.getroot().iter():
        name = element.get("url", "").removeprefix("#")
        if _local_name(element) == "instance_geometry" and name not in known:
            raise UnusableMesh(f"its geometry {name[:80]!r} is missing or cannot be read")
        if _local_name(element) in UNSUPPORTED_ELEMENTS:
            raise UnusableMesh(f"<{_local_name(element)}> is not read, only triangles, polylists and polygons")


def _local_name(element: "ET.Element") -> str:
    """Return the tag of an element without its XML namespace."""
    return str(element.tag).rpartition("}")[2]


def _parts_of_nodes(nodes: list[object]) -> Iterator[MeshPart]:
    """Yield the parts of a COLLADA scene in the unit of the file.

    The first name of a part is the name of its node or, if the node has no name, of the nearest named node above it.
    """
    from collada.scene import GeometryNode, Node

    pending = [(node, np.eye(4), "") for node in reversed(nodes)]
    node_count = face_count = 0
    while pending:
        node, parent_matrix, node_name = pending.pop()
        node_count += 1
        if node_count > MAX_NODES:
            raise UnusableMesh(f"more than {MAX_NODES} nodes")
        if isinstance(node, GeometryNode):
            for part in _parts_of_geometry(node.geometry, parent_matrix, node_name):
                face_count += len(part.faces)
                _check_face_count(face_count)
                yield part
        elif isinstance(node, Node):
            element = getattr(node, "node", node).xmlnode  # <node>, also if `node` is an <instance_node>
            name = element.get("name") or node_name
            matrix = parent_matrix @ np.asarray(node.matrix, float)
            pending.extend((child, matrix, name) for child in reversed(node.children or []))


def _parts_of_geometry(geometry: Any, matrix: Array, node_name: str) -> Iterator[MeshPart]:
    """Yield the triangles of a COLLADA geometry, transformed by a matrix (4, 4)."""
    names = tuple(name for name in (node_name, geometry.name, geometry.id) if name)
    for primitive in geometry.primitives:
        triangles = primitive.triangleset() if hasattr(primitive, "triangleset") else primitive
        if getattr(triangles, "vertex", None) is None or not hasattr(triangles, "ntriangles"):
            continue  # lines, or an empty primitive
        vertices = np.asarray(triangles.vertex, float) @ matrix[:3, :3].T + matrix[:3, 3]
        faces = np.asarray(triangles.vertex_index, np.int64).reshape(-1, 3)
        is_mirrored = np.linalg.det(matrix[:3, :3]) < 0
        yield MeshPart(names, vertices, faces[:, ::-1] if is_mirrored else faces)
