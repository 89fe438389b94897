"""Ground planes, other planes, and the height of a floor that a world models as geometry."""

import math
from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Box, Solid
from simscen.worlds.geometry.triangulation import fuse
from simscen.worlds.sdf import values
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.report import Report

THICKNESS = 0.02
GROUND_TOLERANCE = 0.01
"""Meters that a horizontal plane may lie off z = 0 and still be the simulator's own floor."""
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


HIGHEST = 0.3
"""Meters above z = 0 up to which a level face can be the floor rather than a platform."""
LOWEST = 0.001
"""Meters below which a floor is at z = 0 anyhow."""
COVERED = 0.8
"""Share of the world's extent that a floor covers; the rest may be a stair or what lies outside."""
MILLIMETERS = 1000


def floor_height(solids: Sequence[Solid], bounds: tuple[float, float, float, float]) -> float:
    """How high in meters the floor lies on which everything in `bounds` stands; 0 when that is the ground itself.

    Of AWS's small_warehouse it is the top of a plate, 2.7 cm above Gazebo's ground plane, over the whole hall.
    """
    mesh = fuse(solids)
    corners: Array = mesh.vertices[mesh.faces]
    edge, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normals = np.cross(edge, other) / 2
    areas = np.linalg.norm(normals, axis=1)
    top = corners[:, :, 2].max(axis=1)
    faces_up = (normals[:, 2] >= LEVEL * areas) & (top > LOWEST) & (top <= HIGHEST)
    heights = np.round(top[faces_up] * MILLIMETERS).astype(np.int64)
    wanted = COVERED * (bounds[2] - bounds[0]) * (bounds[3] - bounds[1])
    covering = [h for h in np.unique(heights) if areas[faces_up][heights == h].sum() >= wanted]
    if not covering:
        return 0.0
    return float(top[faces_up][heights == covering[-1]].max())
