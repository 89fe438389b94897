"""What a link is made of: its collision solids and its mass."""

from collections.abc import Iterator
from dataclasses import dataclass

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Solid
from simscen.worlds.sdf import values
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.placing import PlacedLink
from simscen.worlds.sdf.report import Report
from simscen.worlds.sdf.scaling import scaled
from simscen.worlds.sdf.shapes import ShapeReader
from simscen.worlds.sdf.vocabulary import judge_children, judge_unknown
from simscen.worlds.sdf.weight import DEFAULT_MASS, mass_of


@dataclass(frozen=True, eq=False)
class LinkContent:
    """A link's collision `solids` in the world frame and its mass in kg."""

    link: PlacedLink
    solids: tuple[Solid, ...]
    mass: float


RUBBER = 1.0
"""Friction of wheels on dry concrete."""


def read_link(link: PlacedLink, reader: ShapeReader, report: Report) -> LinkContent:
    """The content of a link; unusable collisions go to the report and are left out."""
    element = link.frame.element
    collisions: list[tuple[Element, list[Solid]]] = []
    for child in element.children:
        with report.skipping():
            if child.tag == "collision":
                collisions.append((child, list(_collision(child, link, reader, report))))
            else:
                judge_unknown(child, "link", report)
    if element.child("collision") is None and element.child("visual"):
        report.note(element.place, "has visuals only: nothing to collide with or to see for a lidar")
    mass = DEFAULT_MASS
    with report.skipping():
        mass = mass_of(element.child("inertial"), collisions)
    return LinkContent(link, tuple(solid for _, solids in collisions for solid in solids), mass)


def _collision(element: Element, link: PlacedLink, reader: ShapeReader, report: Report) -> Iterator[Solid]:
    judge_children(element, "collision", report)
    geometry = element.child("geometry")
    if geometry is None:
        raise element.unusable("<geometry> is missing")
    _note_untouchable(element, report)
    pose = link.pose.compose(_in_link(element.child("pose"), link))
    name = f"{link.name}::{element.name}" if element.name else link.name
    friction = _friction(element, report)
    for solid in reader.solids(geometry, pose):
        yield Solid(scaled(solid.shape, link.scale), pose.compose(solid.pose), name, friction)


def _friction(collision: Element, report: Report) -> float:
    """`<mu>` of ODE's surface, where that is less than a wheel's own: ODE takes the lesser of two (so does Gazebo)."""
    found: Element | None = collision
    for tag in ("surface", "friction", "ode", "mu"):
        found = found.child(tag) if found is not None else None
    if found is None:
        return RUBBER
    try:
        mu = float(found.text)
    except ValueError:
        mu = -1.0
    if not mu >= 0:
        report.note(found.place, f"no coefficient of friction: {RUBBER:g} is taken")
        return RUBBER
    return min(RUBBER, mu)


def _in_link(given: Element | None, link: PlacedLink) -> Pose3:
    """`link_from_collision`; a pose relative to another frame of the model is brought back to the link."""
    frame, scope = values.relative_to(given), link.model.scope
    if given is None or frame in ("", link.frame.name):
        return values.pose(given)
    return scope.place(link.frame).inverse().compose(scope.find(frame, given)).compose(values.pose(given))


def _note_untouchable(collision: Element, report: Report) -> None:
    for below in collision.descendants():
        masked = below.tag == "collide_bitmask" and below.text.lower().removeprefix("0x").strip("0") == ""
        if masked or (below.tag == "collide_without_contact" and below.text.lower() in ("1", "true")):
            report.note(below.place, "not supported: the robot collides with it all the same")
