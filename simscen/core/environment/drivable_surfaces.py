"""What of a static world is ground to wheels: ramps, sills, steps, platforms.

A world is flat unless one of its surfaces that face upwards begins so low that a wheel could get onto it; then so are
the surfaces that lead on from there. What else stands in a world is walls: wheels never touch it, the hull does.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array
from simscen.core.geometry.shapes import TriangleMesh

if TYPE_CHECKING:
    import numpy.typing as npt

    Faces = npt.NDArray[np.bool_]

FLOOR_HEIGHT_M = 0.005
"""Faces that lie wholly below this height in m are left to the ground plane, on which wheels roll smoothly."""
MAX_SLOPE_RAD = math.radians(50)
"""What is steeper is a wall, whatever drives: rubber on dry concrete (friction 1) holds up to 45°."""
SOLIDS_PER_BATCH = 64
"""Solids that all others are compared with in one go, which takes memory for each pair."""

Owners = frozenset[int]


def face_normals(mesh: TriangleMesh) -> Array:
    """The unit normals (n, 3) of the faces of a mesh; zero for one without area."""
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    across = np.cross(b - a, c - a)
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    unit: Array = across / np.where(lengths > 0, lengths, 1.0)
    return unit


def upward_faces(mesh: TriangleMesh, steepest: float = MAX_SLOPE_RAD) -> Faces:
    """Which faces are above FLOOR, face upwards and are no steeper than an angle in rad."""
    top = mesh.vertices[mesh.faces, 2].max(axis=1, initial=-math.inf)
    found: Faces = (face_normals(mesh)[:, 2] >= math.cos(steepest)) & (top > FLOOR_HEIGHT_M)
    return found


@cached_on_instance
def drivable_solids(mesh: TriangleMesh, reach: float) -> Owners:
    """The solids of a static mesh, by number, that wheels which get onto a step of `reach` m at most may roll on."""
    faces = np.flatnonzero(upward_faces(mesh))
    corners = mesh.vertices[mesh.faces[faces]]
    bottom = corners[:, :, 2].min(axis=1)
    if not (bottom <= reach).any():
        return frozenset()
    owners, number = np.unique(mesh.owners[faces], return_inverse=True)
    low, high = np.full((len(owners), 3), math.inf), np.full((len(owners), 3), -math.inf)
    np.minimum.at(low, number, corners.min(axis=1))
    np.maximum.at(high, number, corners.max(axis=1))
    reached = low[:, 2] <= reach
    fresh: Faces = reached
    while fresh.any():
        leads = np.zeros(len(owners), dtype=np.bool_)
        for some in np.array_split(np.flatnonzero(fresh), 1 + fresh.sum() // SOLIDS_PER_BATCH):
            apart = (low[:, None] > high[some] + reach) | (high[:, None] + reach < low[some])
            leads |= np.any(~np.any(apart, axis=2), axis=1)
        fresh = leads & ~reached
        reached = reached | leads
    return frozenset(owners[reached].tolist())
