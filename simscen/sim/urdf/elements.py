"""Parses the links and joints of a URDF (wiki.ros.org/urdf/XML). Ignores visual elements."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from simscen.assets.folders import AllowedFolders, NoSuchFile, UnusableFile
from simscen.assets.uris import PACKAGE_SCHEMES
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere
from simscen.sim.body.inertia import MassProperties
from simscen.sim.urdf.xml_source import MAX_MESH_BYTES, Element, InvalidElement

MAX_MESH_EXTENT_M = 20.0
"""Largest allowed absolute coordinate of a mesh in its own frame in m."""

MeshReader = Callable[[Path], Mesh]
"""Returns the triangles of a mesh file in m; raises ValueError for an invalid file."""


@dataclass(frozen=True, eq=False)
class Link:
    """A link with its collision shapes and mass properties in the link frame. `mass` is None without `<inertial>`."""

    name: str
    solids: tuple[Solid, ...]
    mass: MassProperties | None
    element: Element


class JointLimits(NamedTuple):
    """Smallest and largest position of a joint in rad or m, and its largest velocity (0: unknown)."""

    lower: float = -math.inf
    upper: float = math.inf
    velocity: float = 0.0


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint: `pose` of the child frame in the parent frame, and unit vector `axis` in the child frame."""

    name: str
    type: str
    parent: str
    child: str
    pose: Pose3
    axis: tuple[float, float, float]
    limits: JointLimits
    element: Element


@dataclass(frozen=True)
class MeshSource:
    """Finds and reads the meshes of a URDF.

    `folder` is the folder of the URDF, and `folders` are the folders that may be read. `read` reads a mesh file (None:
    meshes are not supported). Absolute paths are allowed if the URDF `is_from_xacro`.
    """

    folder: Path
    folders: AllowedFolders
    read: MeshReader | None
    is_from_xacro: bool = False

    def load_mesh(self, element: Element) -> Mesh:
        """Read the file of a `<mesh>` element, and apply the element's scale; raises InvalidElement."""
        uri = element.text("filename")
        scale = element.numbers("scale", 3, (1.0, 1.0, 1.0))
        try:
            path = self.folders.check_file(self._find(uri), MAX_MESH_BYTES)
            if self.read is None:
                raise UnusableFile("meshes cannot be read here")
            mesh = self.read(path)
        except (UnusableFile, ValueError) as error:
            hint = error.hint if isinstance(error, UnusableFile) else ""
            raise InvalidElement(element, f"mesh {uri[:200]!r}: {error}", hint) from error
        with np.errstate(over="ignore"):
            vertices = mesh.vertices * np.array(scale)
            farthest = float(np.abs(vertices).max(initial=0.0))
        if not farthest <= MAX_MESH_EXTENT_M:
            hint = 'is it in millimeters? give it scale="0.001 0.001 0.001"'
            raise InvalidElement(
                element, f"mesh {uri[:200]!r} reaches {farthest:.4g} m, more than {MAX_MESH_EXTENT_M:g} m", hint
            )
        return Mesh(vertices, mesh.faces)

    def _find(self, uri: str) -> Path:
        """Return the path of a mesh file; raises UnusableFile."""
        try:
            return self.folders.find(uri, self.folder, allow_absolute=self.is_from_xacro)
        except NoSuchFile:
            if uri.startswith(PACKAGE_SCHEMES):  # a missing package gives a more helpful error
                self.folders.package_folder(uri.partition("://")[2].partition("/")[0], self.folder)
            raise


def parse_link(element: Element, meshes: MeshSource) -> Link:
    """Parse a `<link>`; raises InvalidElement."""
    collisions = tuple(
        Solid(
            _parse_shape(collision.required_child("geometry"), meshes), _parse_origin(collision), element.text("name")
        )
        for collision in element.all("collision")
    )
    inertial = element.child("inertial")
    return Link(element.text("name"), collisions, None if inertial is None else _parse_mass(inertial), element)


def parse_joint(element: Element) -> Joint:
    """Parse a `<joint>`; raises InvalidElement."""
    has_axis = element.attributes.get("type") not in ("fixed", "floating")
    axis_element = element.child("axis") if has_axis else None
    axis = (1.0, 0.0, 0.0) if axis_element is None else axis_element.numbers("xyz", 3, (1.0, 0.0, 0.0))
    length = math.hypot(*axis)
    if length == 0:
        raise InvalidElement(element, f"joint {element.name!r} turns about an axis of length 0")
    return Joint(
        element.text("name"),
        element.text("type"),
        element.required_child("parent").text("link"),
        element.required_child("child").text("link"),
        _parse_origin(element),
        (axis[0] / length, axis[1] / length, axis[2] / length),
        _parse_limits(element),
        element,
    )


def _parse_limits(joint: Element) -> JointLimits:
    limit = joint.child("limit")
    if limit is None or joint.attributes.get("type") in ("fixed", "floating"):
        return JointLimits()
    lower, upper, velocity = (
        limit.numbers(key, 1, (0.0,), largest=math.inf)[0] for key in ("lower", "upper", "velocity")
    )
    if joint.attributes.get("type") == "continuous":
        lower, upper = -math.inf, math.inf
    return JointLimits(lower, upper, velocity)


def _parse_origin(element: Element) -> Pose3:
    origin = element.child("origin")
    if origin is None:
        return Pose3()
    x, y, z = origin.numbers("xyz", 3, (0.0, 0.0, 0.0))
    roll, pitch, yaw = origin.numbers("rpy", 3, (0.0, 0.0, 0.0))
    return Pose3.from_rpy(x, y, z, roll, pitch, yaw)


def _parse_shape(geometry: Element, meshes: MeshSource) -> Shape:
    for element in geometry.children:
        match element.tag:
            case "box":
                x, y, z = element.positive("size", 3)
                return Box((x, y, z))
            case "cylinder":
                return Cylinder(element.positive("radius")[0], element.positive("length")[0])
            case "capsule":
                return Capsule(element.positive("radius")[0], element.positive("length")[0])
            case "sphere":
                return Sphere(element.positive("radius")[0])
            case "mesh":
                return meshes.load_mesh(element)
            case other:
                raise InvalidElement(
                    element, f"unknown geometry <{other}>", "use box, cylinder, sphere, capsule, or mesh"
                )
    raise InvalidElement(geometry, "<geometry> is empty")


def _parse_mass(inertial: Element) -> MassProperties:
    mass = inertial.required_child("mass").numbers("value", 1)[0]
    if mass < 0:
        raise InvalidElement(inertial.required_child("mass"), "a mass must not be negative")
    tensor = inertial.child("inertia")
    values = [0.0] * 6
    if tensor is not None:
        values = [tensor.numbers(key, 1, (0.0,))[0] for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")]
        if min(values[0], values[3], values[5]) < 0:
            raise InvalidElement(tensor, "a moment of inertia must not be negative")
    xx, xy, xz, yy, yz, zz = values
    properties = MassProperties(mass, np.zeros(3), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    return properties.transformed(_parse_origin(inertial))
