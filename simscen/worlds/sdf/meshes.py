"""`<mesh>`: triangles of COLLADA, STL and OBJ files, concave ones as they are.

A COLLADA `<unit>` is honored; `<up_axis>` is not, because Gazebo does not: its ColladaLoader never reads it and its
AssimpLoader undoes the rotation that assimp adds. Worlds are drawn accordingly: Nav2's tb3_sandbox says Y_UP in
meshes that stand upright along z.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simscen.assets.folders import Trouble
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry.shapes import Mesh
from simscen.worlds.sdf import values
from simscen.worlds.sdf.files import MESH_BYTES, Library
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.mesh_files import Part, UnusableMesh
from simscen.worlds.sdf.meshcache import READ
from simscen.worlds.sdf.report import CODE, Report


@dataclass(frozen=True)
class _Wish:
    """What a `<mesh>` asks for; equal wishes share one mesh."""

    path: Path
    scale: tuple[float, ...]
    submesh: str
    centered: bool


class MeshShelf:
    """Reads each mesh file once and hands out meshes; equal ones are the same object."""

    def __init__(self, library: Library, report: Report) -> None:
        self.library, self.report = library, report
        self._parts: dict[Path, tuple[Part, ...]] = {}
        self._meshes: dict[_Wish, Mesh] = {}

    def read(self, element: Element) -> Mesh:
        """The mesh a `<mesh>` element asks for; raises Unusable."""
        uri = element.child("uri")
        if uri is None:
            raise element.unusable("<uri> is missing")
        wish = self._wish(element, self.library.locate(uri))
        if wish not in self._meshes:
            parts = self._chosen(self._open(wish.path, uri), wish, element)
            mesh = _joined(parts, wish)
            if np.abs(mesh.vertices).max() > values.FARTHEST:
                raise element.unusable(f"the mesh reaches farther than {values.FARTHEST:g} m")
            self._meshes[wish] = mesh
        if element.attributes.get("optimization") or element.child("convex_decomposition"):
            self.report.note(element.place, "convex hulls are not made, the mesh is used as it is")
        return self._meshes[wish]

    def _wish(self, element: Element, path: Path) -> _Wish:
        scale, submesh = element.child("scale"), element.child("submesh")
        factors = values.numbers(scale, 3) if scale else (1.0, 1.0, 1.0)
        if scale and 0.0 in factors:
            raise scale.unusable("a scale of zero")
        if submesh is None:
            return _Wish(path, factors, "", centered=False)
        name = submesh.child("name")
        if name is None or not name.text:
            raise submesh.unusable("<name> is missing")
        return _Wish(path, factors, name.text, values.truth(submesh.child("center")))

    def _open(self, path: Path, uri: Element) -> tuple[Part, ...]:
        if path not in self._parts:
            data = self.library.read(path, uri, MESH_BYTES)
            try:
                self._parts[path] = READ.read(data, path.suffix.lower(), self.library.shown(path))
            except UnusableMesh as error:
                raise uri.unusable(f"{self.library.shown(path)}: {error}") from error
        return self._parts[path]

    @staticmethod
    def _chosen(parts: tuple[Part, ...], wish: _Wish, element: Element) -> tuple[Part, ...]:
        chosen = tuple(part for part in parts if not wish.submesh or wish.submesh in part.names)
        if not chosen:
            known = sorted({part.names[0] for part in parts if part.names})
            hint = "it has " + ", ".join(known[:10]) if known else "it has no named parts"
            raise element.unusable(f"no submesh {wish.submesh[:80]!r} in {wish.path.name}", hint)
        return chosen


def read_mesh(path: Path) -> Mesh:
    """All triangles of a DAE, STL or OBJ file in meters, for a caller that knows that this file may be read.

    Raises InvalidInput for the file as a whole: not a regular file, too large, broken, no triangles.
    """
    real = path.resolve()
    try:
        data = Library.of([real.parent]).open(real, MESH_BYTES)[1]
        parts = READ.read(data, path.suffix.lower(), path.name)
    except (Trouble, UnusableMesh) as error:
        raise InvalidInput([Problem(str(path), 0, 0, CODE, str(error))]) from error
    return _joined(parts, _Wish(path, (1.0, 1.0, 1.0), "", centered=False))


def _joined(parts: tuple[Part, ...], wish: _Wish) -> Mesh:
    vertices = np.vstack([part.vertices for part in parts])
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    faces = np.vstack([part.faces + start for part, start in zip(parts, starts, strict=True)]).astype(np.int32)
    if wish.centered:
        vertices = vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    vertices = vertices * wish.scale
    if np.prod(wish.scale) < 0:  # a mirrored triangle runs clockwise
        faces = faces[:, ::-1]
    mesh = Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
    mesh.vertices.flags.writeable = mesh.faces.flags.writeable = False
    return mesh
