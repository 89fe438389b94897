"""Content of links: their collision solids in the world, with friction, and their mass."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from typing_extensions import assert_never

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Solid, Sphere
from simscen.worlds.geometry.triangulation import triangulate
from simscen.worlds.sdf.elements import Element, parse_bool, read_pose, read_positive, reference_frame
from simscen.worlds.sdf.known_elements import report_unknown, report_unknown_children
from simscen.worlds.sdf.link_poses import PlacedLink, Scale
from simscen.worlds.sdf.report import ImportReport
from simscen.worlds.sdf.shapes import ShapeReader

DEFAULT_FRICTION = 1.0
"""Coefficient of friction of rubber wheels on dry concrete."""
WATER_DENSITY = 1000.0
"""Density in kg/m³ that SDF assumes for `<inertial auto="true">`."""
DEFAULT_MASS_KG = 1.0
"""SDF's default mass of a link."""


@dataclass(frozen=True, eq=False)
class LinkContent:
    """A link, its collision `solids` in the world frame, and its mass in kg."""

    link: PlacedLink
    solids: tuple[Solid, ...]
    mass: float


def read_link(link: PlacedLink, reader: ShapeReader, report: ImportReport) -> LinkContent:
    """Read the content of a link; unusable collisions are added to the report and left out."""
    element = link.frame.element
    collisions: list[tuple[Element, list[Solid]]] = []
    for child in element.children:
        with report.skip_unusable():
            if child.tag == "collision":
                collisions.append((child, list(_collision_solids(child, link, reader, report))))
            else:
                report_unknown(child, "link", report)
    if element.child("collision") is None and element.child("visual"):
        report.note(element.place, "has only visuals: robots cannot collide with it, and lidars do not see it")
    mass = DEFAULT_MASS_KG
    with report.skip_unusable():
        mass = _link_mass(element.child("inertial"), collisions)
    return LinkContent(link, tuple(solid for _, solids in collisions for solid in solids), mass)


def _collision_solids(
    collision: Element, link: PlacedLink, reader: ShapeReader, report: ImportReport
) -> Iterator[Solid]:
    report_unknown_children(collision, "collision", report)
    geometry = collision.child("geometry")
    if geometry is None:
        raise collision.unusable("<geometry> is missing")
    _note_disabled_contacts(collision, report)
    pose = link.pose.compose(_pose_in_link(collision.child("pose"), link))
    name = f"{link.name}::{collision.name}" if collision.name else link.name
    friction = _friction(collision, report)
    for solid in reader.solids(geometry, pose):
        yield Solid(_scaled(solid.shape, link.scale), pose.compose(solid.pose), name, friction)


def _friction(collision: Element, report: ImportReport) -> float:
    """Return `<mu>` of ODE's surface, at most the friction of a wheel: ODE and Gazebo use the lesser of two."""
    mu_element: Element | None = collision
    for tag in ("surface", "friction", "ode", "mu"):
        mu_element = mu_element.child(tag) if mu_element is not None else None
    if mu_element is None:
        return DEFAULT_FRICTION
    try:
        mu = float(mu_element.text)
    except ValueError:
        mu = -1.0
    if not mu >= 0:
        report.note(mu_element.place, f"not a coefficient of friction: {DEFAULT_FRICTION:g} is used")
        return DEFAULT_FRICTION
    return min(DEFAULT_FRICTION, mu)


def _pose_in_link(pose: Element | None, link: PlacedLink) -> Pose3:
    """Return `link_from_collision`; the pose may be relative to another frame of the model."""
    frame, scope = reference_frame(pose), link.model.scope
    if pose is None or frame in ("", link.frame.name):
        return read_pose(pose)
    return scope.pose_of(link.frame).inverse().compose(scope.pose_of_name(frame, pose)).compose(read_pose(pose))


def _note_disabled_contacts(collision: Element, report: ImportReport) -> None:
    for element in collision.descendants():
        text = element.text.lower()
        has_no_bits = element.tag == "collide_bitmask" and text.removeprefix("0x").strip("0") == ""
        if has_no_bits or (element.tag == "collide_without_contact" and text in ("1", "true")):
            report.note(element.place, "not supported: the robot still collides with it")


def _scaled(shape: Shape, scale: Scale) -> Shape:
    """Return a shape with its sizes multiplied; a radius is multiplied by the x component, as in Gazebo Classic."""
    if scale == (1.0, 1.0, 1.0):
        return shape
    x, y, z = scale
    match shape:
        case Box((a, b, c)):
            return Box((a * x, b * y, c * z))
        case Cylinder(radius, length) | Capsule(radius, length) | Cone(radius, length):
            return type(shape)(radius * x, length * z)
        case Sphere(radius):
            return Sphere(radius * x)
        case Ellipsoid((a, b, c)):
            return Ellipsoid((a * x, b * y, c * z))
        case Extrusion(polygon, height):
            return Extrusion(tuple((px * x, py * y) for px, py in polygon), height * z)
        case Mesh(vertices, faces):
            return Mesh(vertices * scale, faces)
        case _:
            assert_never(shape)


def _link_mass(inertial: Element | None, collisions: Sequence[tuple[Element, Sequence[Solid]]]) -> float:
    """Return the mass in kg that an `<inertial>` states, or the mass of the collisions if it is `auto`."""
    if inertial is None:
        return DEFAULT_MASS_KG
    if parse_bool(inertial.attributes.get("auto", "0"), inertial):
        mass = sum(_density(element, inertial) * _volume(s.shape) for element, solids in collisions for s in solids)
        if mass > 0:
            return mass
    return read_positive(inertial, "mass") if inertial.child("mass") else DEFAULT_MASS_KG


def _density(collision: Element, inertial: Element) -> float:
    owner = next((owner for owner in (collision, inertial) if owner.child("density")), None)
    return read_positive(owner, "density") if owner else WATER_DENSITY


def _volume(shape: Shape) -> float:
    """Return the volume in m³ enclosed by a shape's triangles, by the divergence theorem.

    An open mesh encloses no volume. For an open mesh the result is the sum of the signed tetrahedra between the
    origin and each triangle, as in sdformat.
    """
    mesh = triangulate(shape)
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6
