"""The primitive shapes of `<geometry>`, and which reader has the others."""

from collections.abc import Callable

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Shape, Solid, Sphere
from simscen.worlds.sdf import values
from simscen.worlds.sdf.files import Library
from simscen.worlds.sdf.heightmap import read_heightmap
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.meshes import MeshShelf
from simscen.worlds.sdf.planes import read_plane
from simscen.worlds.sdf.polyline import read_polylines
from simscen.worlds.sdf.report import Report
from simscen.worlds.sdf.vocabulary import SHAPES, judge_children


def _box(element: Element) -> Shape:
    x, y, z = values.sizes(element, "size", 3)
    return Box((x, y, z))


def _cylinder(element: Element) -> Shape:
    return Cylinder(values.size(element, "radius"), values.size(element, "length"))


def _sphere(element: Element) -> Shape:
    return Sphere(values.size(element, "radius"))


def _capsule(element: Element) -> Shape:
    return Capsule(values.size(element, "radius"), values.size(element, "length"))


def _ellipsoid(element: Element) -> Shape:
    x, y, z = values.sizes(element, "radii", 3)
    return Ellipsoid((x, y, z))


def _cone(element: Element) -> Shape:
    return Cone(values.size(element, "radius"), values.size(element, "length"))


PRIMITIVES: dict[str, Callable[[Element], Shape]] = {
    "box": _box,
    "cylinder": _cylinder,
    "sphere": _sphere,
    "capsule": _capsule,
    "ellipsoid": _ellipsoid,
    "cone": _cone,
}


class ShapeReader:
    """Turns `<geometry>` into solids; remembers whether a ground plane was among them."""

    def __init__(self, library: Library, report: Report) -> None:
        self.library, self.report = library, report
        self.meshes = MeshShelf(library, report)
        self.ground = False

    def solids(self, geometry: Element, world_from_geometry: Pose3) -> tuple[Solid, ...]:
        """The solids of one `<geometry>`, placed in its own frame; none for the ground, which the simulator has.

        Raises Unusable for anything that is not a shape of SDF 1.12 with sensible sizes.
        """
        found = [child for child in geometry.children if not child.tag.startswith("xacro:")]
        if not found:
            raise geometry.unusable("holds no shape")
        first = found[0]
        if any(child.tag != first.tag for child in found):
            raise geometry.unusable("holds more than one shape: " + ", ".join(child.tag[:60] for child in found[:5]))
        for shape in found:
            if shape.tag in SHAPES:
                judge_children(shape, shape.tag, self.report)
        match first.tag:
            case tag if tag in PRIMITIVES:
                return (Solid(PRIMITIVES[tag](first)),)
            case "plane":
                solid = read_plane(first, world_from_geometry, self.report)
                self.ground = self.ground or solid is None
                return (solid,) if solid else ()
            case "polyline":
                return read_polylines(found)
            case "heightmap":
                return (read_heightmap(first, self.library),)
            case "mesh":
                return (Solid(self.meshes.read(first)),)
            case "empty":
                return ()
            case tag:
                raise first.unusable(f"<{tag[:60]}> is not a shape that is read", f"one of {', '.join(SHAPES)}")
