"""Find the height of the floor of an SDF world. The floor on which robots drive can be a slab above z = 0."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.meshes import face_normals
from simscen.core.geometry.shapes import Solid, TriangleMesh
from simscen.worlds.extent import top_height
from simscen.worlds.geometry.cross_section import CrossSection
from simscen.worlds.geometry.prisms import bounding_rectangle
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.map_size import Bounds
from simscen.worlds.maps.rasterization import filled_cells
from simscen.worlds.sdf.shapes import MIN_LEVEL_NORMAL_Z

MAX_FLOOR_HEIGHT_M = 0.3
"""Maximum height of the top of a floor that carries other geometry in a world without a ground plane."""
MAX_COVERING_HEIGHT_M = 0.05
"""Maximum height of the top of a floor covering: a thin slab that is a floor even if it lies on a ground plane."""
MIN_FLOOR_HEIGHT_M = 0.001
"""A floor up to this height counts as being at z = 0."""
MIN_FLOOR_WIDTH_M = 1.0
"""Minimum width of a floor that carries other geometry. Narrower slabs are steps or curbs."""
MIN_COVERING_WIDTH_M = 4.0
"""Minimum width of a floor covering. Smaller slabs are platforms."""
MIN_COVERED_FRACTION = 0.8
"""Minimum fraction of the area of the world that a floor covers."""
MAX_UNCOVERED_WIDTH_M = 1.0
"""Maximum width of the ground plane beside a floor covering. Walls can stand there."""
SAMPLES_PER_SIDE = 64
"""Number of rows and columns of the grid on which the covered area is measured."""

FaceIndices = npt.NDArray[np.int64]
"""Indices (n,) of faces of a mesh."""


def floor_height(solids: Sequence[Solid], static_count: int, bounds: Bounds, has_ground: bool) -> float:
    """Return the height in m of the floor on which everything in `bounds` stands; 0 if it is at z = 0.

    solids:        solids in the world frame: first `static_count` static solids, then the solids of movable bodies
    static_count:  number of static solids
    bounds:        bounds of the world
    has_ground:    whether the world has a ground plane at z = 0

    A static level slab is the floor if it covers nearly all of `bounds`, and is either thin and wide, or carries other
    geometry in a world without a ground plane.
    """
    mesh = merge_solids(solids)
    top = mesh.vertices[mesh.faces, 2].max(axis=1)
    is_low = (top > MIN_FLOOR_HEIGHT_M) & (top <= MAX_FLOOR_HEIGHT_M) & (mesh.owners < static_count)
    low = np.flatnonzero(is_low)
    level = low[face_normals(replace(mesh, faces=mesh.faces[low]))[:, 2] >= MIN_LEVEL_NORMAL_Z]
    heights_mm = np.round(top[level] * 1000).astype(np.int64)
    for height_mm in np.unique(heights_mm)[::-1]:
        faces = level[heights_mm == height_mm]
        if _is_floor(mesh, faces, bounds, has_ground):
            return float(top[faces].max())
    return 0.0


def could_be_floor(solid: Solid) -> bool:
    """Return whether a solid is low enough to be a floor, and as wide as a floor covering."""
    left, bottom, right, top = bounding_rectangle(solid)
    return min(right - left, top - bottom) >= MIN_COVERING_WIDTH_M and top_height(solid) <= MAX_FLOOR_HEIGHT_M


def _is_floor(mesh: TriangleMesh, faces: FaceIndices, bounds: Bounds, has_ground: bool) -> bool:
    """Return whether level `faces`, all at one height, are the floor of the world; see `floor_height`."""
    corners: Array = mesh.vertices[mesh.faces[faces]]
    height = corners[..., 2].max()
    low, high = corners[..., :2].min(axis=(0, 1)), corners[..., :2].max(axis=(0, 1))
    width = (high - low).min()
    is_covering = height <= MAX_COVERING_HEIGHT_M and width >= MIN_COVERING_WIDTH_M
    if has_ground:
        uncovered = max((low - bounds[:2]).max(), (bounds[2:] - high).max())
        is_possible = is_covering and uncovered <= MAX_UNCOVERED_WIDTH_M
    else:
        is_possible = is_covering or (width >= MIN_FLOOR_WIDTH_M and _carries_geometry(mesh, height))
    return is_possible and _covered_fraction(corners[..., :2], bounds) >= MIN_COVERED_FRACTION


def _carries_geometry(mesh: TriangleMesh, height: float) -> bool:
    """Return whether a solid stands on a floor at `height` m, or contains the floor and extends above it.

    The solid begins below `height` plus MAX_COVERING_HEIGHT_M, and ends above this height.
    """
    heights = mesh.vertices[mesh.faces, 2]
    lowest, highest = np.full(len(mesh.names), np.inf), np.full(len(mesh.names), -np.inf)
    np.minimum.at(lowest, mesh.owners, heights.min(axis=1))
    np.maximum.at(highest, mesh.owners, heights.max(axis=1))
    stands = (lowest <= height + MAX_COVERING_HEIGHT_M) & (highest > height + MAX_COVERING_HEIGHT_M)
    return bool(stands.any())


def _covered_fraction(triangles: Array, bounds: Bounds) -> float:
    """Return the fraction of `bounds` that is covered by counterclockwise triangles (n, 3, 2), which may overlap."""
    left, bottom, right, top = bounds
    cells = (triangles - (left, bottom)) * SAMPLES_PER_SIDE / (right - left, top - bottom)
    segments = np.stack((cells, np.roll(cells, -1, axis=1)), axis=2).reshape(-1, 2, 2)
    owners = np.repeat(np.arange(len(triangles), dtype=np.int32), 3)
    return float(filled_cells(CrossSection(segments, owners), (SAMPLES_PER_SIDE, SAMPLES_PER_SIDE)).mean())
