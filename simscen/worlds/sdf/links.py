"""What a link is made of: its collision solids, its mass and where its weight sits."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.shapes import Solid
from simscen.worlds.sdf import values, weight
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.placing import PlacedLink
from simscen.worlds.sdf.report import Report
from simscen.worlds.sdf.shapes import ShapeReader
from simscen.worlds.sdf.vocabulary import judge_children, judge_unknown

WATER = 1000.0
"""kg/m³, the density SDF assumes for `<inertial auto="true">`."""


@dataclass(frozen=True, eq=False)
class LinkContent:
    """A link's collision `solids` in the world frame, its mass in kg and its centre of mass (3,) in the world."""

    link: PlacedLink
    solids: tuple[Solid, ...]
    mass: float
    centre: Array


def read_link(link: PlacedLink, reader: ShapeReader, report: Report) -> LinkContent:
    """The content of a link; unusable collisions go to the report and are left out."""
    element = link.frame.element
    inertial = element.child("inertial")
    solids: list[Solid] = []
    densities: list[float] = []
    for child in element.children:
        with report.skipping():
            if child.tag != "collision":
                judge_unknown(child, "link", report)
                continue
            found = list(_collision(child, link, reader, report))
            densities += [_density(child, inertial)] * len(found)
            solids += found
    if element.child("collision") is None and element.child("visual"):
        report.note(element.place, "has visuals only: nothing to collide with or to see for a lidar")
    mass, centre = 1.0, np.array(link.pose.position)  # SDF's defaults: 1 kg at the link's origin
    with report.skipping():
        mass, centre = _weight(link, solids, densities)
    return LinkContent(link, tuple(solids), mass, centre)


def _collision(element: Element, link: PlacedLink, reader: ShapeReader, report: Report) -> Iterator[Solid]:
    judge_children(element, "collision", report)
    geometry = element.child("geometry")
    if geometry is None:
        raise element.unusable("<geometry> is missing")
    _note_untouchable(element, report)
    pose = link.pose.compose(_in_link(element.child("pose"), link))
    name = f"{link.name}::{element.name}" if element.name else link.name
    for solid in reader.solids(geometry, pose):
        yield replace(solid, pose=pose.compose(solid.pose), name=name)


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


def _density(collision: Element, inertial: Element | None) -> float:
    for owner in (collision, inertial):
        if owner is not None and owner.child("density"):
            return values.positive(owner, "density")
    return WATER


def _weight(link: PlacedLink, solids: list[Solid], densities: list[float]) -> tuple[float, Array]:
    """Mass in kg and centre of mass (3,) in the world."""
    inertial = link.frame.element.child("inertial")
    if inertial is None:
        return 1.0, np.array(link.pose.position)
    if solids and values.truth_of(inertial.attributes.get("auto", "0"), inertial):
        measured = [weight.volume_and_centre(solid.shape) for solid in solids]
        masses = np.array([density * volume for density, (volume, _) in zip(densities, measured, strict=True)])
        centres = np.array([s.pose.apply(c[None])[0] for s, (_, c) in zip(solids, measured, strict=True)])
        if masses.sum() > 0:
            return float(masses.sum()), masses @ centres / masses.sum()
    mass = values.positive(inertial, "mass") if inertial.child("mass") else 1.0
    return mass, np.array(link.pose.compose(values.pose(inertial.child("pose"))).position)
