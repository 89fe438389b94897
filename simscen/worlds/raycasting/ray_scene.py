"""Ray casting with Embree: one scene for the static world, one for resting bodies, and one for each moving body."""

import math
from collections.abc import Iterator, Mapping, Set
from types import MappingProxyType

import numpy as np

from simscen.core.geometry import Array, Pose3, Vector, forward_and_left
from simscen.core.geometry.meshes import submesh_between_heights
from simscen.core.geometry.ray_fans import RayCaster, RayFan, Singles
from simscen.core.geometry.shapes import Mesh, TriangleMesh
from simscen.worlds.raycasting.mesh_scene import (
    HeightRange,
    MeshScene,
    MovingMesh,
    cached_mesh_scene,
    packets_towards_sphere,
    rays_hitting_sphere,
)

PlacedMesh = tuple[TriangleMesh, Pose3]
"""A mesh in the frame of a body, and the pose of that frame."""

MAX_GROUP_TRIANGLES = 20_000
"""Maximum number of triangles of a group, whose scene takes 10 ms to build."""
MAX_GROUPS = 16
"""Number of groups at which all groups are rebuilt when another body comes to rest."""


class RestingBodies:
    """All resting bodies, in groups. A group is split when one of its bodies leaves."""

    def __init__(self, middle: Array) -> None:
        """Create an empty set. `middle` (3,) is the center of the world, to which all scenes are relative."""
        self._middle = middle
        self._bodies: Mapping[str, PlacedMesh] = {}
        self._groups: list[RestingGroup] = []

    def __bool__(self) -> bool:
        return bool(self._groups)

    def set_bodies(self, bodies: Mapping[str, PlacedMesh]) -> None:
        """Set the bodies that are at rest now."""
        previous, self._bodies = self._bodies, bodies
        unchanged = {name for name, body in previous.items() if name in bodies and _is_same(body, bodies[name])}
        if len(unchanged) < len(previous):
            removed = previous.keys() - unchanged
            self._groups = [part for group in self._groups for part in group.split_without(removed)]
        if len(unchanged) < len(bodies):
            if len(self._groups) >= MAX_GROUPS:
                self._groups, unchanged = [], set()
            new = {name: body for name, body in bodies.items() if name not in unchanged}
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


def _is_same(one: PlacedMesh, other: PlacedMesh) -> bool:
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

    def split_without(self, removed: Set[str]) -> Iterator["RestingGroup"]:
        """Yield this group, or its parts without the bodies in `removed`.

        The group is halved repeatedly, so that each body that leaves causes less to be rebuilt.
        """
        if removed.isdisjoint(self._meshes):
            yield self
        elif not removed >= self._meshes.keys():
            for half in self._halves():
                yield from half.split_without(removed)

    def _halves(self) -> Iterator["RestingGroup"]:
        """Yield two groups, divided along the longest side of the bounding box."""
        along = int((self._high - self._low).argmax())
        names = sorted(self._meshes, key=lambda name: (self._meshes[name].vertices[:, along].mean(), name))
        for half_names in (names[: len(names) // 2], names[len(names) // 2 :]):
            yield RestingGroup(self._middle, {name: self._meshes[name] for name in half_names})

    def _scene(self, heights: HeightRange) -> MeshScene:
        if self._part is None or heights != self._heights:
            merged = _merged(list(self._meshes.values()))
            self._part = MeshScene(submesh_between_heights(merged.vertices, merged.faces, heights), self._middle)
            self._heights = heights
        return self._part

    def min_distance(self, position: Vector) -> float:
        """Return a lower bound of the distance in m from a position."""
        return math.dist(self._center, position) - self._radius

    def sweep(self, fan: RayFan, pose: Pose3, heights: HeightRange) -> None:
        """Shorten the rays of a fan, which is already turned to `pose`."""
        for packets in packets_towards_sphere(fan, pose, self._center, self._radius):
            self._scene(heights).sweep(fan, pose[:3], packets)

    def cast(self, origins: Array, directions: Array, heights: HeightRange, ends: Singles) -> None:
        """Shorten the `ends` (n,) of rays with different origins, in place."""
        rays = rays_hitting_sphere(self._center, self._radius, origins, directions, ends)
        if len(rays):
            ends[rays] = self._scene(heights).distances(origins[rays], directions[rays], ends[rays])


def _merged(meshes: list[Mesh]) -> Mesh:
    """Return one mesh of all meshes."""
    firsts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])]).tolist()
    faces = [mesh.faces + np.int32(first) for mesh, first in zip(meshes, firsts, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


NO_HOMES: Mapping[str, Pose3] = MappingProxyType({})

_MAX_RANGE_M = 1e30
"""Maximum length of a ray in single precision."""
_END_FACTOR = 1.001
"""End of a ray without a hit, as a multiple of its range."""
_HEIGHT_MARGIN_M, _ROUNDING_MARGIN_M = 0.1, 0.01
"""Minimum margin of the height range from which triangles are taken, and upper bound of rounding errors."""


class RayScene(RayCaster):
    """A `core.geometry.ray_fans.RayCaster` over the triangles of a world and of the bodies that move in it.

    The scene of a moving body is built once in its own frame, and the few rays that come near it are transformed to
    that frame. The triangles of bodies that rest at their home pose are transformed to the world frame, once, so that
    many bodies are one scene. The frame affects the last bits of distances, so it depends only on the current poses,
    not on earlier calls.

    Distances agree with PyBullet's rays within 1 mm. Embree works in single precision. Each scene is therefore relative
    to its own center: a world that is 10 km from the origin loses no precision, a world that is 10 km wide 0.5 mm.
    """

    def __init__(self, static: "TriangleMesh | RayScene") -> None:
        """Create a scene of the static mesh of a world, or with that of another scene."""
        self._static: MeshScene = static._static if isinstance(static, RayScene) else cached_mesh_scene(static)
        self._movers: dict[str, MovingMesh] = {}
        self._resting = RestingBodies(self._static.middle)
        self._heights = math.inf, -math.inf

    def set_moving(self, bodies: Mapping[str, PlacedMesh], homes: Mapping[str, Pose3] = NO_HOMES) -> None:
        """Set the current bodies: by name, the mesh in the body's frame and the pose of that frame.

        A body at the pose in `homes` is treated as resting.
        """
        previous, self._movers = self._movers, {}
        resting = dict[str, PlacedMesh]()
        for name, (mesh, pose) in bodies.items():
            if homes and homes.get(name) == pose:
                resting[name] = mesh, pose
                continue
            mover = previous.get(name)
            if mover is None or mover.mesh is not mesh:
                mover = MovingMesh(mesh, cached_mesh_scene(mesh), pose)
            elif mover.pose != pose:
                mover = MovingMesh(mesh, mover.part, pose)
            self._movers[name] = mover
        if resting or self._resting:
            self._resting.set_bodies(resting)

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """Return distances (n,) in m along unit `directions` (n, 3) from `origins` (n, 3); inf beyond `reach`."""
        limit = min(reach, _MAX_RANGE_M)
        if not len(origins):
            return np.empty(0)
        distances = self._first_hits(origins, directions, reach, limit * _END_FACTOR)
        result = distances.astype(np.float64)
        result[distances > limit] = np.inf
        return result

    def sweep(self, fan: RayFan, pose: Pose3, reach: float) -> Singles:
        """Return the distances (n,) in m of a fan with its frame at `pose`; values beyond `reach` mean no hit.

        This method runs once per scan, so that each numpy call (1 µs) counts.
        """
        position, (ahead, left) = pose[:3], forward_and_left(pose[3:])
        fan.set_directions(ahead, left)
        fan.set_length(min(reach, _MAX_RANGE_M) * _END_FACTOR)
        self._static.sweep(fan, position)
        if self._resting:
            rise = _max_rise(math.hypot(ahead[2], left[2]), reach)
            self._resting.sweep(fan, pose, reach, self._height_range(position[2] - rise, position[2] + rise))
        for mover in self._movers.values():
            if mover.min_distance(position) <= reach:
                mover.sweep(fan, pose, (ahead, left))
        return fan.rays.distances()

    def _first_hits(self, origins: Array, directions: Array, reach: float, end: float) -> Singles:
        """Return the distances (n,) to the first hits of rays with different origins."""
        x, y, z = origins[0].tolist()
        reach += float(np.linalg.norm(origins - (x, y, z), axis=1).max())
        ends = self._static.distances(origins, directions, end)
        if self._resting:
            low, high = origins[:, 2].min(), origins[:, 2].max()
            down, up = directions[:, 2].min(), directions[:, 2].max()
            heights = self._height_range(low - _max_rise(-down, reach), high + _max_rise(up, reach))
            self._resting.cast(origins, directions, heights, ends)
        for mover in self._movers.values():
            if mover.min_distance((x, y, z)) <= reach:
                rays = rays_hitting_sphere(mover.middle, mover.part.radius, origins, directions, ends)
                if len(rays):
                    ends[rays] = mover.distances(origins[rays], directions[rays], ends[rays])
        return ends

    def _height_range(self, low: float, high: float) -> HeightRange:
        """Return the height range of triangles for rays between two heights; the last range is kept if it suffices."""
        below, above = self._heights
        if not (below <= low - _ROUNDING_MARGIN_M and high + _ROUNDING_MARGIN_M <= above):
            low, high = min(low, below), max(high, above)
            margin = max(_HEIGHT_MARGIN_M, high - low)  # a lidar that tilts more and more needs only a few new ranges
            self._heights = low - margin, high + margin
        return self._heights


def _max_rise(slope: float, reach: float) -> float:
    """Return the maximum rise in m of a ray with the vertical component `slope` of its unit direction."""
    return slope * reach if slope > 0 else 0.0


def build_mesh_scene(mesh: TriangleMesh) -> None:
    """Build the scene of a static mesh before runs are forked; this takes 0.2 µs per triangle."""
    cached_mesh_scene(mesh)
