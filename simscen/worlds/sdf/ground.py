"""Planes: the floor everybody has, and the others."""

import math

import numpy as np

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Solid
from simscen.worlds.sdf import values
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.report import Report

THICKNESS = 0.02
GROUND_TOLERANCE = 0.01
"""Metres that a horizontal plane may lie off z = 0 and still be the simulator's own floor."""
LEVEL = math.cos(math.radians(0.5))


def read_plane(plane: Element, world_from_plane: Pose3, report: Report) -> Solid | None:
    """A slab of the plane's `size` whose upper face is the plane; None for the ground, which the simulator has."""
    normal = _normal(plane)
    x, y = values.sizes(plane, "size", 2, default=(1.0, 1.0))
    world_normal = world_from_plane.rotation() @ normal
    if world_normal[2] >= LEVEL:
        if abs(world_from_plane.z) <= GROUND_TOLERANCE:
            return None
        report.note(
            plane.place,
            f"level plane at z = {world_from_plane.z:g} m, the floor is at z = 0; it becomes a slab of {x:g} x {y:g} m",
        )
    turn = _turn_to(normal)
    return Solid(Box((x, y, THICKNESS)), turn.compose(Pose3(z=-THICKNESS / 2)))


def _normal(plane: Element) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    element = plane.child("normal")
    normal = np.array(values.numbers(element, 3) if element else (0.0, 0.0, 1.0))
    length = float(np.linalg.norm(normal))
    if element and length < 1e-9:
        raise element.unusable("the normal has no length")
    return normal / length


def _turn_to(normal: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Pose3:
    """The shortest turn from z to the unit vector `normal`; half a turn about x when that is -z."""
    x, y, z = (float(part) for part in normal)
    if z < -1 + 1e-12:
        return Pose3(0, 0, 0, 1.0, 0, 0, 0)
    qx, qy, qz, qw = -y, x, 0.0, 1 + z
    norm = math.hypot(qx, qy, qw)
    return Pose3(0, 0, 0, qx / norm, qy / norm, qz, qw / norm)
