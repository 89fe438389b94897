"""The floor that a world brings along as geometry: robots stand on it, so it is where z = 0 must be."""

from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Solid
from simscen.worlds.meshing import fuse
from simscen.worlds.sdf.ground import LEVEL

HIGHEST = 0.3
"""Metres above z = 0 up to which a level face can be the floor rather than a platform."""
LOWEST = 0.001
"""Metres below which a floor is at z = 0 anyhow."""
COVERED = 0.8
"""Share of the world's extent that a floor covers; the rest may be a stair or what lies outside."""
MILLIMETRES = 1000


def floor_height(solids: Sequence[Solid], bounds: tuple[float, float, float, float]) -> float:
    """How high in metres the floor lies on which everything in `bounds` stands; 0 when that is the ground itself.

    Of AWS's small_warehouse it is the top of a plate, 2.7 cm above Gazebo's ground plane, over the whole hall.
    """
    mesh = fuse(solids)
    corners: Array = mesh.vertices[mesh.faces]
    edge, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normals = np.cross(edge, other) / 2
    areas = np.linalg.norm(normals, axis=1)
    top = corners[:, :, 2].max(axis=1)
    faces_up = (normals[:, 2] >= LEVEL * areas) & (top > LOWEST) & (top <= HIGHEST)
    heights = np.round(top[faces_up] * MILLIMETRES).astype(np.int64)
    wanted = COVERED * (bounds[2] - bounds[0]) * (bounds[3] - bounds[1])
    covering = [h for h in np.unique(heights) if areas[faces_up][heights == h].sum() >= wanted]
    if not covering:
        return 0.0
    return float(top[faces_up][heights == covering[-1]].max())
