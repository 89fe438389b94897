"""Convert `<mesh>` and `<heightmap>` elements to triangle meshes.

The `<unit>` of a COLLADA file is applied, but its `<up_axis>` is ignored, as in Gazebo.
"""

import hashlib
import io
import warnings
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simscen.assets.folders import UnusableFile
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.meshes import concatenate_meshes
from simscen.core.geometry.shapes import Mesh, Solid
from simscen.worlds.sdf.elements import MAX_COORDINATE_M, Element, read_bool, read_numbers, read_sizes
from simscen.worlds.sdf.files import MAX_MESH_BYTES, WorldFiles
from simscen.worlds.sdf.mesh_files import MeshPart, UnusableMesh, read_parts
from simscen.worlds.sdf.report import PROBLEM_CODE, ImportReport

MAX_CACHE_BYTES = 256 << 20
"""Maximum size of all vertices and faces in the cache. The newest file is kept even if it is larger."""
MAX_HEIGHTMAP_PIXELS = 513
"""Maximum width and height of the image of a heightmap. Gazebo's heightmaps have 2^n + 1 pixels."""
IMAGE_FORMATS = ("PNG", "BMP", "PPM", "JPEG", "TIFF")
"""Pillow's names of the formats of heightmaps."""
GRAY_MODES = ("L", "I", "I;16", "I;16B", "F")
"""Pillow's single-channel modes. Images in other modes are converted to L."""


class MeshCache:
    """Cache of parsed mesh files in memory, by their content. The least recently used file is dropped first.

    Forked processes inherit the cache. All callers receive the same arrays, which must not be changed.
    """

    def __init__(self, max_bytes: int = MAX_CACHE_BYTES) -> None:
        self._max_bytes = max_bytes
        self._parts: OrderedDict[str, tuple[MeshPart, ...]] = OrderedDict()

    def read(self, data: bytes, suffix: str) -> tuple[MeshPart, ...]:
        """Return the parts in the content of a file with this suffix. Raises UnusableMesh."""
        key = hashlib.sha256(suffix.encode() + b"\0" + data).hexdigest()
        if key not in self._parts:
            self._parts[key] = read_parts(data, suffix)
            while len(self._parts) > 1 and sum(map(_size_in_bytes, self._parts.values())) > self._max_bytes:
                self._parts.popitem(last=False)
        self._parts.move_to_end(key)
        return self._parts[key]


def _size_in_bytes(parts: tuple[MeshPart, ...]) -> int:
    return sum(part.vertices.nbytes + part.faces.nbytes for part in parts)


MESH_CACHE = MeshCache()
"""Cache that all worlds and robots of this process share."""


@dataclass(frozen=True)
class MeshRequest:
    """Content of a `<mesh>` element: a file, and how to use it."""

    path: Path
    scale: tuple[float, ...] = (1.0, 1.0, 1.0)
    """Factors for x, y and z."""
    submesh: str = ""
    """Name of the part to use; "" for all parts."""
    is_centered: bool = False
    """Whether the center of the bounding box is moved to the origin."""


class MeshReader:
    """Reads the meshes that the elements of one world refer to. Elements with equal content share one `Mesh`."""

    def __init__(self, files: WorldFiles, report: ImportReport) -> None:
        self._files, self._report = files, report
        self._meshes: dict[MeshRequest, Mesh] = {}

    def read(self, element: Element) -> Mesh:
        """Return the mesh that a `<mesh>` element refers to. Raises UnusableElement."""
        uri = element.child("uri")
        if uri is None:
            raise element.unusable("<uri> is missing")
        request = _mesh_request(element, self._files.locate(uri))
        if request not in self._meshes:
            mesh = _merge_parts(_select_submesh(self._read_file(request.path, uri), request, element), request)
            if np.abs(mesh.vertices).max() > MAX_COORDINATE_M:
                raise element.unusable(f"the mesh reaches farther than {MAX_COORDINATE_M:g} m")
            self._meshes[request] = mesh
        if element.attributes.get("optimization") or element.child("convex_decomposition"):
            self._report.note(element.location, "convex hulls are not computed; the mesh is used unchanged")
        return self._meshes[request]

    def _read_file(self, path: Path, uri: Element) -> tuple[MeshPart, ...]:
        data = self._files.read(path, uri, MAX_MESH_BYTES)
        try:
            return MESH_CACHE.read(data, path.suffix.lower())
        except UnusableMesh as error:
            raise uri.unusable(f"{self._files.display_path(path)}: {error}") from error


def read_mesh(path: Path) -> Mesh:
    """Return all triangles of a DAE, STL or OBJ file in m, without checking whether its folder is allowed.

    Raises InvalidInput if the file is not a regular file, too large, broken, or without triangles.
    """
    real_path = path.resolve()
    try:
        data = WorldFiles.of([real_path.parent]).read_file(real_path, MAX_MESH_BYTES)[1]
        parts = MESH_CACHE.read(data, path.suffix.lower())
    except (UnusableFile, UnusableMesh) as error:
        raise InvalidInput([Problem(str(path), 0, 0, PROBLEM_CODE, str(error))]) from error
    return _merge_parts(parts, MeshRequest(path))


def _mesh_request(element: Element, path: Path) -> MeshRequest:
    """Return the content of a `<mesh>` element that refers to the file `path`. Raises UnusableElement."""
    scale_element, submesh = element.child("scale"), element.child("submesh")
    scale = read_numbers(scale_element, 3) if scale_element else (1.0, 1.0, 1.0)
    if scale_element and 0.0 in scale:
        raise scale_element.unusable("a scale of zero")
    if submesh is None:
        return MeshRequest(path, scale)
    name = submesh.child("name")
    if name is None or not name.text:
        raise submesh.unusable("<name> is missing")
    return MeshRequest(path, scale, name.text, read_bool(submesh.child("center")))


def _select_submesh(parts: tuple[MeshPart, ...], request: MeshRequest, element: Element) -> tuple[MeshPart, ...]:
    """Return the parts with the requested name, or all parts. Raises UnusableElement if there are none."""
    selected = tuple(part for part in parts if not request.submesh or request.submesh in part.names)
    if not selected:
        known = sorted({part.names[0] for part in parts if part.names})
        hint = "it has " + ", ".join(known[:10]) if known else "it has no named parts"
        raise element.unusable(f"no submesh {request.submesh[:80]!r} in {request.path.name}", hint)
    return selected


def _merge_parts(parts: tuple[MeshPart, ...], request: MeshRequest) -> Mesh:
    """Return one read-only mesh of all parts, centered and scaled as requested."""
    whole = concatenate_meshes([Mesh(part.vertices, part.faces.astype(np.int32)) for part in parts])
    vertices, faces = whole.vertices, whole.faces
    with np.errstate(over="ignore"):  # huge coordinates and scales become infinite
        if request.is_centered:
            vertices = vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        vertices = vertices * request.scale
    if sum(factor < 0 for factor in request.scale) % 2:  # a mirrored triangle runs clockwise
        faces = faces[:, ::-1]
    mesh = Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
    mesh.vertices.flags.writeable = mesh.faces.flags.writeable = False
    return mesh


def read_heightmap(element: Element, files: WorldFiles) -> Solid:
    """Return the terrain of a `<heightmap>` as a solid, centered on `<pos>`. Raises UnusableElement.

    As in Gazebo, the height of the brightest pixel is the z of `<size>`, and the height of black pixels is 0.
    """
    uri = element.child("uri")
    if uri is None:
        raise element.unusable("<uri> is missing")
    x, y, z = read_sizes(element, "size", 3, default=(1.0, 1.0, 1.0))
    pos = element.child("pos")
    origin = read_numbers(pos, 3) if pos else (0.0, 0.0, 0.0)
    return Solid(terrain_mesh(_read_relative_heights(uri, files) * z, x, y), Pose3(*origin))


def _read_relative_heights(uri: Element, files: WorldFiles) -> Array:
    """Return the heights (rows, columns) in an image: 0 for black, 1 for the brightest pixel. Row 0 is the top."""
    from PIL import Image

    path = files.locate(uri)
    data = files.read(path, uri, MAX_MESH_BYTES)
    try:
        # Too many pixels are refused below, so Pillow's warning about them is not needed.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            image = Image.open(io.BytesIO(data), formats=IMAGE_FORMATS)
        with image:
            if max(image.size) > MAX_HEIGHTMAP_PIXELS or min(image.size) < 2:
                size = f"{image.size[0]} x {image.size[1]} pixels"
                raise uri.unusable(
                    f"{files.display_path(path)}: {size}; an edge must have 2 to {MAX_HEIGHTMAP_PIXELS} pixels"
                )
            gray = image if image.mode in GRAY_MODES else image.convert("L")
            pixels = np.asarray(gray, dtype=np.float64)
    except Image.DecompressionBombError as error:
        raise uri.unusable(f"{files.display_path(path)}: image too large") from error
    except (OSError, ValueError, SyntaxError) as error:
        raise uri.unusable(f"{files.display_path(path)}: not a readable image (PNG, BMP, PGM, JPEG or TIFF)") from error
    if not np.isfinite(pixels).all() or pixels.min() < 0:
        raise uri.unusable(
            f"{files.display_path(path)}: a height is negative or not a number", "save it as 16-bit gray"
        )
    brightest = float(pixels.max())
    return pixels / brightest if brightest > 0 else pixels


def terrain_mesh(heights: Array, width: float, depth: float) -> Mesh:
    """Return a mesh with two triangles per cell between the samples `heights` (rows, columns); all lengths in m.

    The terrain is `width` m long along x and `depth` m along y, and centered on the z axis. The first row is at +y.
    """
    rows, columns = heights.shape
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, columns), np.linspace(depth / 2, -depth / 2, rows))
    vertices = np.column_stack([x.ravel(), y.ravel(), heights.ravel()])
    index = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    nw, ne, sw, se = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack([nw, sw, se], axis=-1), np.stack([nw, se, ne], axis=-1)], axis=2)
    return Mesh(vertices, faces.reshape(-1, 3))
