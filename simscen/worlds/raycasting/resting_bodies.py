"""Embree scenes of bodies that rest at their home poses: many bodies in one scene, in the world frame."""

import math
from collections.abc import Iterator, Mapping, Set

import numpy as np

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.geometry.meshes import submesh_between_heights
from simscen.core.geometry.ray_fans import RayFan, Singles
from simscen.core.geometry.shapes import Mesh, TriangleMesh
from simscen.worlds.raycasting.mesh_scene import HeightRange, MeshScene, packets_towards_sphere, rays_meeting_sphere

PlacedMesh = tuple[TriangleMesh, Pose3]
"""A mesh in the frame of a body, and the pose of that frame."""

MAX_GROUP_TRIANGLES = 20_000
"""Maximum number of triangles of a group, whose scene takes 10 ms to build."""
MAX_GROUPS = 16
"""Number of groups from which on all are rebuilt when another body comes to rest."""


class RestingBodies:
    """All resting bodies, in groups. A group is split when one of its bodies leaves."""

    def __init__(self, middle: Array) -> None:
        """Create an empty set. `middle` (3,) is the center of the world, to which all scenes are relative."""
        self._middle = middle
        self._bodies: Mapping[str, PlacedMesh] = {}
        self._groups: list[RestingGroup] = []

    def __bool__(self) -> bool:
        return bool(self._groups)

    def keep(self, bodies: Mapping[str, PlacedMesh]) -> None:
        """Set the bodies that rest now."""
        before, self._bodies = self._bodies, bodies
        stay = {name for name, body in before.items() if name in bodies and _same(body, bodies[name])}
        if len(stay) < len(before):
            gone = before.keys() - stay
            self._groups = [rest for group in self._groups for rest in group.without(gone)]
        if len(stay) < len(bodies):
            if len(self._groups) >= MAX_GROUPS:
                self._groups, stay = [], set()
            new = {name: body for name, body in bodies.items() if name not in stay}
            meshes = {name: Mesh(pose.apply(mesh.vertices), mesh.faces) for name, (mesh, pose) in new.items()}
            self._groups += RestingGroup(self._middle, meshes).split_to_limit()

    def sweep(self, fan: RayFan, pose: Pose3, reach: float, heights: HeightRange) -> None:
        """Shorten the rays of a fan, which is already turned to `pose`."""
        for group in self._groups:
            if group.min_distance(pose[:3]) <= reach:
                group.sweep(fan, pose, heights)

    def cast(self, origins: Array, directions: Array, heights: HeightRange, ends: Singles) -> None:
        """Shorten the `ends` (n,) of rays with different origins, in place."""
        for group in self._groups:
            group.cast(origins, directions, heights, ends)


def _same(one: PlacedMesh, other: PlacedMesh) -> bool:
    return one[0] is other[0] and one[1] == other[1]


class RestingGroup:
    """Resting bodies with a common scene, which is built when rays come near.

    The hits of a ray do not depend on other bodies of the scene, so the grouping does not affect results.
    """

    def __init__(self, middle: Array, meshes: Mapping[str, Mesh]) -> None:
        """Create a group of meshes in the world frame, by name; `middle` (3,) is the center of the world."""
        self._middle, self._meshes = middle, meshes
        corners = np.concatenate([mesh.vertices for mesh in meshes.values()])
        self._low, self._high = corners.min(axis=0), corners.max(axis=0)
        x, y, z = ((self._low + self._high) / 2).tolist()
        self._center = x, y, z
        self._radius = 1.001 * float(np.linalg.norm(corners - self._center, axis=1).max())
        self._part: MeshScene | None = None
        self._heights: HeightRange | None = None

    def split_to_limit(self) -> Iterator["RestingGroup"]:
        """Yield this group, or its parts with at most MAX_GROUP_TRIANGLES."""
        if len(self._meshes) == 1 or sum(len(mesh.faces) for mesh in self._meshes.values()) <= MAX_GROUP_TRIANGLES:
            yield self
        else:
            for half in self._halves():
                yield from half.split_to_limit()

    def without(self, gone: Set[str]) -> Iterator["RestingGroup"]:
        """Yield this group, or its parts without the bodies in `gone`.

        The group is halved repeatedly, so that each body that leaves causes less to be rebuilt.
        """
        if gone.isdisjoint(self._meshes):
            yield self
        elif not gone >= self._meshes.keys():
            for half in self._halves():
                yield from half.without(gone)

    def _halves(self) -> Iterator["RestingGroup"]:
        """Yield two groups, divided along the longest side of the bounding box."""
        along = int((self._high - self._low).argmax())
        names = sorted(self._meshes, key=lambda name: (self._meshes[name].vertices[:, along].mean(), name))
        for some in (names[: len(names) // 2], names[len(names) // 2 :]):
            yield RestingGroup(self._middle, {name: self._meshes[name] for name in some})

    def _scene(self, heights: HeightRange) -> MeshScene:
        if self._part is None or heights != self._heights:
            merged = _merged(list(self._meshes.values()))
            self._part = MeshScene(submesh_between_heights(merged.vertices, merged.faces, heights), self._middle)
            self._heights = heights
        return self._part

    def min_distance(self, place: Vector) -> float:
        """Return a lower bound of the distance in m from a place."""
        return math.dist(self._center, place) - self._radius

    def sweep(self, fan: RayFan, pose: Pose3, heights: HeightRange) -> None:
        """Shorten the rays of a fan, which is already turned to `pose`."""
        for packets in packets_towards_sphere(fan, pose, self._center, self._radius):
            self._scene(heights).sweep(fan, pose[:3], packets)

    def cast(self, origins: Array, directions: Array, heights: HeightRange, ends: Singles) -> None:
        """Shorten the `ends` (n,) of rays with different origins, in place."""
        rays = rays_meeting_sphere(self._center, self._radius, origins, directions, ends)
        if len(rays):
            ends[rays] = self._scene(heights).distances(origins[rays], directions[rays], ends[rays])


def _merged(meshes: list[Mesh]) -> Mesh:
    """Return one mesh of all meshes."""
    firsts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])]).tolist()
    faces = [mesh.faces + np.int32(first) for mesh, first in zip(meshes, firsts, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))
