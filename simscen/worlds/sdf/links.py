"""Read the collision geometry and the mass of links."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from typing_extensions import assert_never

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Solid, Sphere
from simscen.worlds.geometry.triangulation import enclosed_volume, triangulate
from simscen.worlds.sdf.elements import Element, parse_bool, read_pose, read_positive, reference_frame
from simscen.worlds.sdf.known_elements import report_unknown, report_unknown_children
from simscen.worlds.sdf.link_poses import PlacedLink, Scale
from simscen.worlds.sdf.report import ImportReport
from simscen.worlds.sdf.shapes import ShapeReader

DEFAULT_FRICTION = 1.0
"""Coefficient of friction without `<mu>`, as for rubber wheels on dry concrete."""
DEFAULT_DENSITY_KG_M3 = 1000.0
"""SDF's default density for `<inertial auto="true">`."""
DEFAULT_MASS_KG = 1.0
"""SDF's default mass of a link."""


@dataclass(frozen=True, eq=False)
class LinkContent:
    """A link with its collision geometry and its mass."""

    link: PlacedLink
    solids: tuple[Solid, ...]
    """Collision geometry in the world frame."""
    mass: float
    """In kg."""


def read_link(link: PlacedLink, reader: ShapeReader, report: ImportReport) -> LinkContent:
    """Return the collisions and the mass of a link. Unusable collisions are added to the report and left out.

    The mass in a static model is not read, because it has no effect: the building editor of Gazebo writes 0.
    """
    element = link.frame.element
    collisions: list[tuple[Element, list[Solid]]] = []
    for child in element.children:
        with report.skip_unusable():
            if child.tag == "collision":
                collisions.append((child, list(_collision_solids(child, link, reader, report))))
            else:
                report_unknown(child, "link", report)
    if element.child("collision") is None and element.child("visual"):
        report.note(element.location, "has only visuals: robots cannot collide with it, and lidars do not see it")
    mass = DEFAULT_MASS_KG
    if not link.model.is_static:
        with report.skip_unusable():
            mass = _link_mass(element.child("inertial"), collisions)
    return LinkContent(link, tuple(solid for _, solids in collisions for solid in solids), mass)


def _collision_solids(
    collision: Element, link: PlacedLink, reader: ShapeReader, report: ImportReport
) -> Iterator[Solid]:
    """Yield the solids of a `<collision>` in the world frame. Raises UnusableElement."""
    report_unknown_children(collision, "collision", report)
    geometry = collision.child("geometry")
    if geometry is None:
        raise collision.unusable("<geometry> is missing")
    _note_disabled_contacts(collision, report)
    pose = link.pose.compose(_pose_in_link(collision.child("pose"), link))
    name = f"{link.name}::{collision.name}" if collision.name else link.name
    friction = _friction(collision, report)
    for solid in reader.solids(geometry, pose):
        yield Solid(_scale_shape(solid.shape, link.scale), pose.compose(solid.pose), name, friction)


def _friction(collision: Element, report: ImportReport) -> float:
    """Return the coefficient of friction `<mu>` of ODE's surface, at most DEFAULT_FRICTION."""
    # In a contact, ODE and Gazebo use the lower friction of the two surfaces, and one of them is a rubber wheel.
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
        report.note(mu_element.location, f"not a coefficient of friction: {DEFAULT_FRICTION:g} is used")
        return DEFAULT_FRICTION
    return min(DEFAULT_FRICTION, mu)


def _pose_in_link(pose: Element | None, link: PlacedLink) -> Pose3:
    """Return the pose of a collision in the frame of the link. `<pose>` may refer to another frame of the model."""
    frame, scope = reference_frame(pose), link.model.scope
    if pose is None or frame in ("", link.frame.name):
        return read_pose(pose)
    return scope.pose_of(link.frame).inverse().compose(scope.pose_of_name(frame, pose)).compose(read_pose(pose))


def _note_disabled_contacts(collision: Element, report: ImportReport) -> None:
    """Add a note for each element that disables contacts in Gazebo, which has no effect in simscen."""
    for element in collision.descendants():
        text = element.text.lower()
        has_no_bits = element.tag == "collide_bitmask" and text.removeprefix("0x").strip("0") == ""
        if has_no_bits or (element.tag == "collide_without_contact" and text in ("1", "true")):
            report.note(element.location, "not supported: the robot still collides with it")


def _scale_shape(shape: Shape, scale: Scale) -> Shape:
    """Return a shape with sizes multiplied by `scale`. A single radius is multiplied by x, as in Gazebo Classic."""
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
    """Return the mass in kg that an `<inertial>` states; with `auto`, volume times density of the collisions."""
    if inertial is None:
        return DEFAULT_MASS_KG
    if parse_bool(inertial.attributes.get("auto", "0"), inertial):
        # For a mesh that is not closed, the volume depends on the origin, as in sdformat.
        mass = 0.0
        for collision, solids in collisions:
            parent = next((element for element in (collision, inertial) if element.child("density")), None)
            density = read_positive(parent, "density") if parent else DEFAULT_DENSITY_KG_M3
            for solid in solids:
                mass += density * abs(enclosed_volume(triangulate(solid.shape)))
        if mass > 0:
            return mass
    return read_positive(inertial, "mass") if inertial.child("mass") else DEFAULT_MASS_KG
