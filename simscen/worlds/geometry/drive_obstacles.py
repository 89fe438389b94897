"""Find the static solids that block a robot that can drive on ramps and over steps.

A solid that the robot can drive on is called ground. Only the edges and the steep slopes of the ground block the robot.
An edge is an upright face of the ground, which is a line when seen from above.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.meshes import drivable_solids, face_normals, is_convex, submesh
from simscen.core.geometry.shapes import Box, Mesh, Solid, TriangleMesh
from simscen.worlds.geometry.prisms import has_no_drivable_solids
from simscen.worlds.geometry.triangulation import merge_solids

FaceMask = npt.NDArray[np.bool_]
"""Mask (n,) of the faces of a mesh."""

EDGE_PIECE_M = 0.1
"""Maximum length of the pieces into which edges are divided. The height of an edge is measured once per piece."""
SAMPLE_OFFSET_M = 0.01
"""Distance to both sides of an edge at which the ground height is measured."""
WALL_THICKNESS_M = 0.01
"""Thickness of the walls and prisms that replace edges and steep slopes."""
MAX_WALL_NORMAL_Z = 0.5
"""Maximum vertical component of the unit normal of an upright face (steeper than 60°). Other faces are slopes."""
_PRISM_FACES = np.array(
    [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]], dtype=np.int32
)
"""Faces of a prism with the corners 0, 1, 2 of its base below its corners 3, 4, 5."""


def drive_obstacles(
    solids: tuple[Solid, ...], wheel_radius: float, max_slope: float, max_step: float
) -> tuple[Solid, ...]:
    """Return the solids that block a robot. If `max_slope` is 0 or no solid is ground, returns `solids` itself.

    The robot climbs slopes up to `max_slope` rad and steps up to `max_step` m. A solid is ground if wheels that climb
    steps of `wheel_radius` m can drive onto it (see `drivable_solids`), and if it is convex or a height field. Edges
    and steep slopes of the ground are returned as thin solids.
    """
    if max_slope <= 0 or has_no_drivable_solids(solids, wheel_radius):
        return solids
    mesh = merge_solids(solids)
    normals = face_normals(mesh)
    drivable = drivable_solids(mesh, wheel_radius)
    ground = {owner for owner in drivable if _is_convex_or_height_field(mesh, normals, owner)}
    if not ground:
        return solids
    obstacles = [solid for number, solid in enumerate(solids) if number not in ground]
    is_ground = np.isin(mesh.owners, sorted(ground))
    walls = _walls_at_edges(mesh, normals, is_ground, max_step)
    return (*obstacles, *walls, *_steep_faces(mesh, normals, is_ground, max_slope))


def _is_convex_or_height_field(mesh: TriangleMesh, normals: Array, owner: int) -> bool:
    """Return whether the solid with the index `owner` is convex or a height field, which has no overhangs."""
    is_of_solid = mesh.owners == owner
    return is_convex(submesh(mesh.vertices, mesh.faces[is_of_solid])) or bool((normals[is_of_solid, 2] >= 0).all())


def _steep_faces(mesh: TriangleMesh, normals: Array, is_ground: FaceMask, max_slope: float) -> Iterator[Solid]:
    """Yield a prism below each sloping face of the ground that is steeper than `max_slope` rad."""
    is_steep = (normals[:, 2] > MAX_WALL_NORMAL_Z) & (normals[:, 2] < math.cos(max_slope) - 1e-9)
    for face in np.flatnonzero(is_ground & is_steep).tolist():
        corners = mesh.vertices[mesh.faces[face]]
        base = corners.copy()
        base[:, 2] = corners[:, 2].min() - WALL_THICKNESS_M
        yield Solid(Mesh(np.concatenate((base, corners)), _PRISM_FACES), name=mesh.names[int(mesh.owners[face])])


def _walls_at_edges(mesh: TriangleMesh, normals: Array, is_ground: FaceMask, max_step: float) -> Iterator[Solid]:
    """Yield thin walls at the edges of the ground where it drops by more than `max_step` m."""
    is_wall = np.abs(normals[:, 2]) <= MAX_WALL_NORMAL_Z
    pieces = list(_edge_pieces(mesh, normals, np.flatnonzero(is_ground & is_wall)))
    if not pieces:
        return
    middles = np.array([(edge.start + edge.end) / 2 for edge in pieces])
    outward = np.array([edge.outward for edge in pieces])
    inside = middles - (SAMPLE_OFFSET_M + np.array([[edge.depth] for edge in pieces])) * outward
    heights = _ground_heights(mesh, is_ground, np.concatenate((inside, middles + SAMPLE_OFFSET_M * outward)))
    walls: list[tuple[_EdgePiece, float, float]] = []
    for edge, high, low in zip(pieces, *np.round(np.split(heights, 2), 4).tolist(), strict=True):
        if high - low > max_step:
            if walls and walls[-1][1:] == (high, low) and walls[-1][0].is_continued_by(edge):
                walls[-1] = (walls[-1][0]._replace(end=edge.end), high, low)
            else:
                walls.append((edge, high, low))
    for edge, high, low in walls:
        yield edge.wall(high, low, mesh.names[edge.owner])


class _EdgePiece(NamedTuple):
    """A piece of an edge.

    start, end (2,):  ends of the piece in m
    outward (2,):     unit vector away from the solid
    owner:            index of the solid
    depth:            horizontal extent in m of the face at right angles to the edge; 0 if the face is vertical
    """

    start: Array
    end: Array
    outward: Array
    owner: int
    depth: float

    def is_continued_by(self, other: "_EdgePiece") -> bool:
        """Return whether `other` is a piece of the same face and starts at the end of this piece."""
        return self.owner == other.owner and self.outward is other.outward and bool((self.end == other.start).all())

    def wall(self, high: float, low: float, name: str) -> Solid:
        """Return a thin wall between the heights `low` and `high` in m."""
        x, y = ((self.start + self.end) / 2 - self.outward * WALL_THICKNESS_M / 2).tolist()
        along = self.end - self.start
        pose = Pose3.planar(Pose2(x, y, math.atan2(along[1], along[0])), (low + high) / 2)
        return Solid(Box((float(np.linalg.norm(along)), WALL_THICKNESS_M, high - low)), pose, name)


def _edge_pieces(mesh: TriangleMesh, normals: Array, faces: npt.NDArray[np.int64]) -> Iterator[_EdgePiece]:
    """Divide the edges of upright `faces` (indices) into pieces. An edge of several faces counts once."""
    seen = set()
    horizontal_normals = normals[:, :2]
    for face in faces.tolist():
        length = np.linalg.norm(horizontal_normals[face])
        if length == 0:  # a triangle without area has no normal
            continue
        outward, owner = horizontal_normals[face] / length, int(mesh.owners[face])
        along = np.array([-outward[1], outward[0]])
        corners = mesh.vertices[mesh.faces[face], :2]
        positions, offsets = corners @ along, corners @ outward
        first, last = (position * along + offsets.max() * outward for position in (positions.min(), positions.max()))
        key = (owner, *np.round(np.concatenate((first, last, outward)), 4).tolist())
        if key in seen or not np.ptp(positions):
            continue
        seen.add(key)
        fractions = np.linspace(0.0, 1.0, max(1, math.ceil(float(np.ptp(positions)) / EDGE_PIECE_M)) + 1)
        ends = first + fractions[:, None] * (last - first)
        yield from (_EdgePiece(a, b, outward, owner, float(np.ptp(offsets))) for a, b in pairwise(ends))


def _ground_heights(mesh: TriangleMesh, is_ground: FaceMask, points: Array) -> Array:
    """Return the heights (n,) in m of the highest ground at points (n, 2); 0 where there is only the floor."""
    from simscen.worlds.raycasting.ray_scene import RayScene

    scene = RayScene(TriangleMesh(mesh.vertices, mesh.faces[is_ground], mesh.owners[is_ground], mesh.names))
    top = float(mesh.vertices[mesh.faces[is_ground], 2].max()) + 1.0
    origins = np.column_stack((points, np.full(len(points), top)))
    down = np.broadcast_to(np.array([0.0, 0.0, -1.0]), origins.shape)
    heights: Array = np.maximum(0.0, top - scene.cast(origins, down))
    return heights
