"""What of a static world is in a robot's way: all of it but the ground that it can drive on.

A ramp is no obstacle to a robot that climbs it, yet its sides are, where they are higher than a step.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.meshes import Owners, drivable_solids, face_normals, is_convex, submesh
from simscen.core.geometry.shapes import Box, Mesh, Solid, TriangleMesh
from simscen.worlds.geometry.prisms import is_flat
from simscen.worlds.geometry.triangulation import fuse

PIECE = 0.1
"""m of an edge whose height is taken as one."""
BESIDE = 0.01
"""m to both sides of an edge where the ground is looked at."""
THICKNESS = 0.01
"""m of what stands for an edge."""
UPRIGHT = 0.5
"""z of the unit normal up to which a face is the edge of something (60°), not a slope."""


def drive_obstacles(solids: tuple[Solid, ...], reach: float, slope: float, step: float) -> tuple[Solid, ...]:
    """The same solids, where none is ground to wheels, else what of them is in the way of a robot.

    `reach` is the radius of its wheels in m, `slope` in rad and `step` in m what it climbs at most.
    """
    if slope <= 0 or is_flat(solids, reach):
        return solids
    mesh = fuse(solids)
    ground = frozenset(owner for owner in drivable_solids(mesh, reach) if _is_plain(mesh, owner))
    if not ground:
        return solids
    stays = [solid for number, solid in enumerate(solids) if number not in ground]
    return (*stays, *_edges(mesh, ground, step), *_too_steep(mesh, ground, slope))


def _is_plain(mesh: TriangleMesh, owner: int) -> bool:
    """Whether a solid is convex, or a height field: of any other shape what is high above a low part is in the way."""
    mine = mesh.owners == owner
    return is_convex(submesh(mesh.vertices, mesh.faces[mine])) or bool((face_normals(mesh)[mine, 2] >= 0).all())


def _too_steep(mesh: TriangleMesh, ground: Owners, slope: float) -> Iterator[Solid]:
    """Each face of the ground that is too steep, as a prism down to its foot."""
    up = face_normals(mesh)[:, 2]
    for face in np.flatnonzero(_of(mesh, ground) & (up > UPRIGHT) & (up < math.cos(slope) - 1e-9)).tolist():
        corners = mesh.vertices[mesh.faces[face]]
        foot = corners.copy()
        foot[:, 2] = corners[:, 2].min() - THICKNESS
        yield Solid(Mesh(np.concatenate((foot, corners)), _PRISM), name=mesh.names[int(mesh.owners[face])])


def _of(mesh: TriangleMesh, ground: Owners) -> npt.NDArray[np.bool_]:
    return np.isin(mesh.owners, sorted(ground))


_PRISM = np.array(
    [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]], dtype=np.int32
)


def _edges(mesh: TriangleMesh, ground: Owners, step: float) -> Iterator[Solid]:
    """Upright faces of the ground as thin walls, where the ground beside them is lower by more than a step."""
    chosen = np.flatnonzero(_of(mesh, ground) & (np.abs(face_normals(mesh)[:, 2]) <= UPRIGHT))
    pieces = list(_pieces(mesh, chosen))
    if not pieces:
        return
    middles = np.array([(edge.start + edge.end) / 2 for edge in pieces])
    out = np.array([edge.outward for edge in pieces])
    behind = middles - (BESIDE + np.array([[edge.depth] for edge in pieces])) * out
    heights = _heights(mesh, ground, np.concatenate((behind, middles + BESIDE * out)))
    walls: list[tuple[_Edge, float, float]] = []
    for edge, high, low in zip(pieces, *np.round(np.split(heights, 2), 4).tolist(), strict=True):
        if high - low > step:
            if walls and walls[-1][1:] == (high, low) and walls[-1][0].runs_on_to(edge):
                walls[-1] = (walls[-1][0]._replace(end=edge.end), high, low)
            else:
                walls.append((edge, high, low))
    for edge, high, low in walls:
        yield edge.wall(high, low, mesh.names[edge.owner])


class _Edge(NamedTuple):
    """A piece of what an upright face is in plan: its ends (2,), the unit vector outwards, and whose face it is.

    One that leans covers `depth` meters inwards of that line.
    """

    start: Array
    end: Array
    outward: Array
    owner: int
    depth: float

    def runs_on_to(self, other: "_Edge") -> bool:
        """Whether the other begins where this one ends, of the same face."""
        return self.owner == other.owner and self.outward is other.outward and bool((self.end == other.start).all())

    def wall(self, high: float, low: float, name: str) -> Solid:
        """A thin wall between two heights."""
        x, y = ((self.start + self.end) / 2 - self.outward * THICKNESS / 2).tolist()
        along = self.end - self.start
        place = Pose3.planar(Pose2(x, y, math.atan2(along[1], along[0])), (low + high) / 2)
        return Solid(Box((float(np.linalg.norm(along)), THICKNESS, high - low)), place, name)


def _pieces(mesh: TriangleMesh, faces: npt.NDArray[np.int64]) -> Iterator[_Edge]:
    """The edges that upright faces are in plan, each once, in pieces."""
    seen = set()
    across = face_normals(mesh)[:, :2]
    for face in faces.tolist():
        outward, owner = across[face] / np.linalg.norm(across[face]), int(mesh.owners[face])
        along = np.array([-outward[1], outward[0]])
        corners = mesh.vertices[mesh.faces[face], :2]
        places, offsets = corners @ along, corners @ outward
        first, last = (place * along + offsets.max() * outward for place in (places.min(), places.max()))
        key = (owner, *np.round(np.concatenate((first, last, outward)), 4).tolist())
        if key in seen or not np.ptp(places):
            continue
        seen.add(key)
        shares = np.linspace(0.0, 1.0, max(1, math.ceil(float(np.ptp(places)) / PIECE)) + 1)
        ends = first + shares[:, None] * (last - first)
        yield from (_Edge(a, b, outward, owner, float(np.ptp(offsets))) for a, b in pairwise(ends))


def _heights(mesh: TriangleMesh, ground: Owners, points: Array) -> Array:
    """How high the ground is at points (n, 2) in m: the uppermost of what wheels may be on, at least 0."""
    from simscen.worlds.raycasting.ray_scene import RayScene

    mine = _of(mesh, ground)
    scene = RayScene(TriangleMesh(mesh.vertices, mesh.faces[mine], mesh.owners[mine], mesh.names))
    top = float(mesh.vertices[mesh.faces[mine], 2].max()) + 1.0
    origins = np.column_stack((points, np.full(len(points), top)))
    down = np.broadcast_to(np.array([0.0, 0.0, -1.0]), origins.shape)
    heights: Array = np.maximum(0.0, top - scene.cast(origins, down))
    return heights
