"""Read the collision geometry and the mass of links, and group links into static solids and movable bodies.

Links that are connected by a joint of any type form one rigid body, because simscen has no jointed obstacles. A joint
to the world or to a static model makes the whole group static. Links without joints are separate bodies.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from typing_extensions import assert_never

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import (
    Body,
    Box,
    Capsule,
    Cone,
    Cylinder,
    Ellipsoid,
    Extrusion,
    Mesh,
    Shape,
    Solid,
    Sphere,
)
from simscen.worlds.geometry.triangulation import triangulate
from simscen.worlds.sdf.elements import (
    Element,
    parse_bool,
    read_bool,
    read_pose,
    read_positive,
    reference_frame,
    report_unknown,
    report_unknown_children,
)
from simscen.worlds.sdf.link_poses import PlacedLink, Scale
from simscen.worlds.sdf.model_tree import ModelNode
from simscen.worlds.sdf.report import ImportReport
from simscen.worlds.sdf.shapes import ShapeReader

DEFAULT_FRICTION = 1.0
"""Coefficient of friction without `<mu>`, as for rubber wheels on dry concrete."""
DEFAULT_DENSITY_KG_M3 = 1000.0
"""SDF's default density for `<inertial auto="true">`."""
DEFAULT_MASS_KG = 1.0
"""SDF's default mass of a link."""
MAX_BODIES = 2000
"""Maximum number of bodies of a world, including actors."""
MAX_MOVABLE_MASS_KG = 1e6
"""Maximum mass of a body that can move. Heavier bodies are an error."""
_WORLD = -1
"""Number that stands for the world in LinkGroups."""


@dataclass(frozen=True, eq=False)
class LinkContent:
    """A link with its collision geometry and its mass."""

    link: PlacedLink
    solids: tuple[Solid, ...]
    """Collision geometry in the world frame."""
    mass: float
    """In kg."""


def read_link(link: PlacedLink, reader: ShapeReader, report: ImportReport) -> LinkContent:
    """Return the collisions and the mass of a link. Unusable collisions are added to the report and left out."""
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
        yield Solid(_scaled(solid.shape, link.scale), pose.compose(solid.pose), name, friction)


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
    for element in collision.descendants():
        text = element.text.lower()
        has_no_bits = element.tag == "collide_bitmask" and text.removeprefix("0x").strip("0") == ""
        if has_no_bits or (element.tag == "collide_without_contact" and text in ("1", "true")):
            report.note(element.location, "not supported: the robot still collides with it")


def _scaled(shape: Shape, scale: Scale) -> Shape:
    """Return a shape with sizes multiplied by `scale`, and a single radius by its x component, as in Gazebo Classic."""
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
        mass = sum(_density(element, inertial) * _volume(s.shape) for element, solids in collisions for s in solids)
        if mass > 0:
            return mass
    return read_positive(inertial, "mass") if inertial.child("mass") else DEFAULT_MASS_KG


def _density(collision: Element, inertial: Element) -> float:
    """Return the density in kg/m³ that a collision or else the `<inertial>` of its link states, or the default."""
    owner = next((owner for owner in (collision, inertial) if owner.child("density")), None)
    return read_positive(owner, "density") if owner else DEFAULT_DENSITY_KG_M3


def _volume(shape: Shape) -> float:
    """Return the volume in m³ that the triangles of a shape enclose.

    For a mesh that is not closed, the result depends on the origin, as in sdformat.
    """
    mesh = triangulate(shape)
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6


class LinkGroups:
    """Disjoint sets (union-find) of links, which are numbered from 0. The links in the set of _WORLD are static."""

    def __init__(self) -> None:
        self._parents: dict[int, int] = {_WORLD: _WORLD}

    def root(self, number: int) -> int:
        """Return the smallest number in the set of a link; _WORLD if the link is static."""
        self._parents.setdefault(number, number)
        while self._parents[number] != number:
            number = self._parents[number]
        return number

    def join(self, first: int, second: int) -> None:
        """Join the sets of two links."""
        low, high = sorted((self.root(first), self.root(second)))
        self._parents[high] = low


def split_model(
    model: ModelNode, pose: Pose3, contents: list[LinkContent], report: ImportReport
) -> tuple[list[Solid], list[Body]]:
    """Return the static solids and the movable bodies of a top-level model at `pose`, in document order.

    `contents` are all links of the model and of nested models. A single movable body has the name and the frame of the
    model. If there are several, each has the name and the frame of its first link.
    """
    groups = _link_groups(model, [content.link for content in contents], report)
    members: dict[int, list[LinkContent]] = {}
    for number, content in enumerate(contents):
        members.setdefault(groups.root(number), []).append(content)
    static = [solid for content in members.pop(_WORLD, []) for solid in content.solids]
    movable = [group for group in members.values() if any(content.solids for content in group)]
    if len(movable) == 1:
        return static, [_body(model.name, pose, movable[0], report)]
    return static, [_body(group[0].link.name, group[0].link.pose, group, report) for group in movable]


def _link_groups(model: ModelNode, links: list[PlacedLink], report: ImportReport) -> LinkGroups:
    """Return the groups of links, given by their indices in `links`. Static links are joined with _WORLD."""
    groups = LinkGroups()
    numbers = {id(link.frame): number for number, link in enumerate(links)}
    for number, link in enumerate(links):
        groups.root(number)
        if link.model.is_static:
            groups.join(_WORLD, number)
    for owner in model.models():
        for joint in owner.joints:
            with report.skip_unusable():
                _join_links(owner, joint, numbers, groups, report)
    return groups


def _join_links(
    owner: ModelNode, joint: Element, numbers: dict[int, int], groups: LinkGroups, report: ImportReport
) -> None:
    """Join the groups of the parent and the child of a joint in the model `owner`. Raises UnusableElement.

    `numbers` are the numbers of links in `groups`, by the id of their frame.
    """
    ends = []
    for tag in ("parent", "child"):
        end = joint.child(tag)
        if end is None or not end.text:
            raise joint.unusable(f"<{tag}> is missing")
        link = owner.scope.link_of_frame(end.text, end)
        ends.append(_WORLD if link is None else numbers.get(id(link), _WORLD))
    joint_type = joint.attributes.get("type", "")
    if joint_type != "fixed" and any(end != _WORLD and groups.root(end) != _WORLD for end in ends):
        report.note(joint.location, f"a joint of type {joint_type[:20] or 'unknown'} is treated as fixed")
    groups.join(*ends)


def _body(name: str, pose: Pose3, group: list[LinkContent], report: ImportReport) -> Body:
    """Return the body of a group of links, with its frame at `pose`."""
    body_from_world = pose.inverse()
    solids = tuple(replace(s, pose=body_from_world.compose(s.pose)) for content in group for s in content.solids)
    mass = 0.0 if _is_kinematic(group, report) else _movable_mass(group, report)
    return Body(name, solids, pose, mass)


def _movable_mass(group: list[LinkContent], report: ImportReport) -> float:
    """Return the total mass of a group in kg; 0 with an error in the report above MAX_MOVABLE_MASS_KG."""
    mass = sum(content.mass for content in group)
    if mass <= MAX_MOVABLE_MASS_KG:
        return mass
    heaviest = max(group, key=lambda content: content.mass).link.frame.element
    message = f"has a mass of {mass:g} kg; at most {MAX_MOVABLE_MASS_KG:g} kg can move"
    report.add_error(heaviest.unusable(message, "if it never moves, make its model <static>"))
    return 0.0


def _is_kinematic(group: list[LinkContent], report: ImportReport) -> bool:
    """Return whether any link of the group is `<kinematic>`, so that contacts do not move the body.

    Adds a note to the report for each link without gravity.
    """
    is_kinematic = False
    for content in group:
        element = content.link.frame.element
        with report.skip_unusable():
            if not read_bool(element.child("gravity"), default=True):
                report.note(element.location, "gravity cannot be switched off for a single link, so it will fall")
            is_kinematic = is_kinematic or read_bool(element.child("kinematic"))
    return is_kinematic


def with_unique_names(bodies: list[Body], report: ImportReport, world: Element) -> tuple[Body, ...]:
    """Return the bodies, with a number appended to each repeated name, and a note at the `world` element.

    Raises UnusableElement for more than MAX_BODIES.
    """
    if len(bodies) > MAX_BODIES:
        raise world.unusable(f"more than {MAX_BODIES} bodies")
    taken: set[str] = set()
    unique = []
    for body in bodies:
        name, number = body.name, 0
        while name.casefold() in taken:
            number += 1
            name = f"{body.name}_{number}"
        if number:
            report.note(world.location, f"the name {body.name!r} is already used; the next body is called {name!r}")
        taken.add(name.casefold())
        unique.append(replace(body, name=name))
    return tuple(unique)
