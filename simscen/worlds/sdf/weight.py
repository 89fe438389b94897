"""What a link weighs."""

from collections.abc import Sequence

import numpy as np

from simscen.core.geometry.shapes import Shape, Solid
from simscen.worlds.geometry.triangulation import triangulate
from simscen.worlds.sdf import values
from simscen.worlds.sdf.markup import Element

WATER = 1000.0
"""kg/m³, the density SDF assumes for `<inertial auto="true">`."""
DEFAULT_MASS = 1.0
"""kg, SDF's default."""


def mass_of(inertial: Element | None, collisions: Sequence[tuple[Element, Sequence[Solid]]]) -> float:
    """The mass in kg that an `<inertial>` states or, if it is `auto`, that its collisions have by their densities."""
    if inertial is None:
        return DEFAULT_MASS
    if values.truth_of(inertial.attributes.get("auto", "0"), inertial):
        mass = sum(_density(element, inertial) * volume(s.shape) for element, solids in collisions for s in solids)
        if mass > 0:
            return mass
    return values.positive(inertial, "mass") if inertial.child("mass") else DEFAULT_MASS


def _density(collision: Element, inertial: Element) -> float:
    stated = next((owner for owner in (collision, inertial) if owner.child("density")), None)
    return values.positive(stated, "density") if stated else WATER


def volume(shape: Shape) -> float:
    """The volume in m³ inside a shape's triangles, by the divergence theorem.

    An open mesh has no inside; its volume is then what the tetrahedra between the origin and each triangle happen to
    add up to, as in sdformat's own calculation.
    """
    mesh = triangulate(shape)
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6
