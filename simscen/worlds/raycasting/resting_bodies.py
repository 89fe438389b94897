"""What lies where it has always lain, in the frame of the world: many bodies in one Embree scene."""

import math
from collections.abc import Iterator, Mapping, Set

import numpy as np

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.geometry.meshes import submesh_between_heights
from simscen.core.geometry.ray_fans import RayFan, Singles
from simscen.core.geometry.shapes import Mesh, TriangleMesh
from simscen.worlds.raycasting.mesh_scene import Heights, MeshScene, meeting, towards

Placed = tuple[TriangleMesh, Pose3]
"""A mesh in the frame of a body, and where that is."""

MANY = 20_000
"""Triangles that are taken as one pile, in 10 ms."""
SEVERAL = 16
"""Piles of which a new one is made, with what has come home."""


class RestingBodies:
    """All bodies that lie at home, of which those that lie together are one pile for as long as none of them leaves."""

    def __init__(self, middle: Array) -> None:
        """In a world about this middle."""
        self._middle = middle
        self._bodies: Mapping[str, Placed] = {}
        self._piles: list[RestingGroup] = []

    def __bool__(self) -> bool:
        return bool(self._piles)

    def keep(self, bodies: Mapping[str, Placed]) -> None:
        """These lie there now, and no others."""
        before, self._bodies = self._bodies, bodies
        stay = {name for name, body in before.items() if name in bodies and _same(body, bodies[name])}
        if len(stay) < len(before):
            gone = before.keys() - stay
            self._piles = [left for pile in self._piles for left in pile.without(gone)]
        if len(stay) < len(bodies):
            if len(self._piles) >= SEVERAL:
                self._piles, stay = [], set()
            come = {name: body for name, body in bodies.items() if name not in stay}
            meshes = {name: Mesh(pose.apply(mesh.vertices), mesh.faces) for name, (mesh, pose) in come.items()}
            self._piles += RestingGroup(self._middle, meshes).small()

    def sweep(self, fan: RayFan, pose: Pose3, reach: float, heights: Heights) -> None:
        """Rays of a fan at `pose` that was turned to it end at what they meet here."""
        for pile in self._piles:
            if pile.away(pose[:3]) <= reach:
                pile.sweep(fan, pose, heights)

    def cast(self, origins: Array, directions: Array, heights: Heights, ends: Singles) -> None:
        """Of rays that begin in places of their own, what they meet before their `ends` (n,) becomes these."""
        for pile in self._piles:
            pile.cast(origins, directions, heights, ends)


def _same(one: Placed, other: Placed) -> bool:
    return one[0] is other[0] and one[1] == other[1]


class RestingGroup:
    """Bodies that lie together; their scene is built once rays come near it.

    What a ray meets does not depend on what else is in a scene, so nobody can tell how bodies are piled.
    """

    def __init__(self, middle: Array, meshes: Mapping[str, Mesh]) -> None:
        """By name, meshes in the world's frame; `middle` is that of the world, about which all of them are kept."""
        self._middle, self._meshes = middle, meshes
        corners = np.concatenate([mesh.vertices for mesh in meshes.values()])
        self._low, self._high = corners.min(axis=0), corners.max(axis=0)
        x, y, z = ((self._low + self._high) / 2).tolist()
        self._center = x, y, z
        self._radius = 1.001 * float(np.linalg.norm(corners - self._center, axis=1).max())
        self._part: MeshScene | None = None
        self._heights: Heights | None = None

    def small(self) -> Iterator["RestingGroup"]:
        """Itself, or those that it falls apart into for none to be of too many triangles."""
        if len(self._meshes) == 1 or sum(len(mesh.faces) for mesh in self._meshes.values()) <= MANY:
            yield self
        else:
            for half in self._halves():
                yield from half.small()

    def without(self, gone: Set[str]) -> Iterator["RestingGroup"]:
        """The piles that it falls apart into where some have gone, if they were in it.

        It is halved until these are alone: what has to be built anew becomes less with each that goes.
        """
        if gone.isdisjoint(self._meshes):
            yield self
        elif not gone >= self._meshes.keys():
            for half in self._halves():
                yield from half.without(gone)

    def _halves(self) -> Iterator["RestingGroup"]:
        """Those on both sides of a line across its longest side."""
        along = int((self._high - self._low).argmax())
        names = sorted(self._meshes, key=lambda name: (self._meshes[name].vertices[:, along].mean(), name))
        for some in (names[: len(names) // 2], names[len(names) // 2 :]):
            yield RestingGroup(self._middle, {name: self._meshes[name] for name in some})

    def _scene(self, heights: Heights) -> MeshScene:
        if self._part is None or heights != self._heights:
            one = _one(list(self._meshes.values()))
            self._part = MeshScene(submesh_between_heights(one.vertices, one.faces, heights), self._middle)
            self._heights = heights
        return self._part

    def away(self, place: Vector) -> float:
        """How far in meters from a place the nearest of it may be."""
        return math.dist(self._center, place) - self._radius

    def sweep(self, fan: RayFan, pose: Pose3, heights: Heights) -> None:
        """Rays of a fan at `pose` that was turned to it end at what they meet here."""
        for packets in towards(fan, pose, self._center, self._radius):
            self._scene(heights).sweep(fan, pose[:3], packets)

    def cast(self, origins: Array, directions: Array, heights: Heights, ends: Singles) -> None:
        """Of rays that begin in places of their own, what they meet before their `ends` (n,) becomes these."""
        rays = meeting(self._center, self._radius, origins, directions, ends)
        if len(rays):
            ends[rays] = self._scene(heights).distances(origins[rays], directions[rays], ends[rays])


def _one(meshes: list[Mesh]) -> Mesh:
    """All of them as one mesh."""
    firsts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])]).tolist()
    faces = [mesh.faces + np.int32(first) for mesh, first in zip(meshes, firsts, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))
