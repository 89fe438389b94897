"""Cast rays in a world that consists of static solids, resting bodies, and moving bodies.

A scene is a set of triangles that rays are cast at (see `mesh_scene.MeshScene`). To sweep a fan means to cast the rays
of a planar lidar: each ray is shortened to end at the first triangle that it hits.
"""

import math
from collections.abc import Iterator, Mapping, Set

import numpy as np

from simscen.core.geometry import Array, Pose3, Vector, forward_and_left
from simscen.core.geometry.meshes import concatenate_meshes, submesh_between_heights
from simscen.core.geometry.ray_fans import Float32Array, RayCaster, RayFan
from simscen.core.geometry.shapes import Mesh, TriangleMesh
from simscen.worlds.raycasting.mesh_scene import (
    MeshScene,
    MovingMesh,
    cached_mesh_scene,
    packets_towards_sphere,
    rays_hitting_sphere,
)

PlacedMesh = tuple[TriangleMesh, Pose3]
"""A mesh in the frame of a body, and the pose of that frame in the world."""
HeightRange = tuple[float, float]
"""Minimum and maximum height in m of rays. Triangles outside this range cannot be hit and are left out."""

MAX_GROUP_TRIANGLES = 20_000
"""Maximum number of triangles of a group of several bodies. Building the scene takes about 10 ms."""
REGROUPING_THRESHOLD = 16
"""If there are this many groups when a body comes to rest, all bodies are grouped anew."""
_MAX_RANGE_M = 1e30
"""Maximum length of a ray, because infinity would overflow in single precision."""
_INITIAL_LENGTH_RATIO = 1.001
"""Initial length of a ray relative to its range. A ray that is still longer than its range has no hit."""
_HEIGHT_MARGIN_M, _ROUNDING_MARGIN_M = 0.1, 0.01
"""Minimum margin of a height range around the rays, and upper bound of rounding errors."""


class RestingBodies:
    """All resting bodies of a world, in groups with one scene each. A group is split when one of its bodies moves."""

    def __init__(self, center: Vector) -> None:
        """Create an empty set. All scenes are relative to `center`, the center of the world."""
        self._center = center
        self._bodies: Mapping[str, PlacedMesh] = {}
        self._groups: list[RestingGroup] = []

    def __bool__(self) -> bool:
        return bool(self._groups)

    def set_bodies(self, bodies: Mapping[str, PlacedMesh]) -> None:
        """Set the bodies that are at rest now, by name."""
        previous, self._bodies = self._bodies, bodies
        unchanged = {
            name
            for name, (mesh, pose) in previous.items()
            if name in bodies and bodies[name][0] is mesh and bodies[name][1] == pose
        }
        if len(unchanged) < len(previous):
            removed = previous.keys() - unchanged
            self._groups = [part for group in self._groups for part in group.split_without(removed)]
        if len(unchanged) < len(bodies):
            if len(self._groups) >= REGROUPING_THRESHOLD:
                self._groups, unchanged = [], set()
            new = {name: body for name, body in bodies.items() if name not in unchanged}
            meshes = {name: Mesh(pose.apply(mesh.vertices), mesh.faces) for name, (mesh, pose) in new.items()}
            self._groups += RestingGroup(self._center, meshes).split_to_limit()

    def sweep(self, fan: RayFan, pose: Pose3, reach: float, heights: HeightRange) -> None:
        """Shorten the rays of a fan at `pose`. Rays are at most `reach` m long, and between the `heights`.

        The directions and lengths of the fan must be set before.
        """
        for group in self._groups:
            if group.min_distance(pose[:3]) <= reach:
                group.sweep(fan, pose, heights)

    def cast(self, origins: Array, directions: Array, heights: HeightRange, lengths: Float32Array) -> None:
        """Shorten single rays in place: reduce their `lengths` (n,) in m to the first hits.

        The rays start at `origins` (n, 3), have the unit vectors `directions` (n, 3), and are between the `heights`.
        """
        for group in self._groups:
            group.cast(origins, directions, heights, lengths)


class RestingGroup:
    """Resting bodies with a common scene, which is built when rays come near. The grouping does not affect results."""

    def __init__(self, world_center: Vector, meshes: Mapping[str, Mesh]) -> None:
        """Create a group from the meshes of the bodies in the world frame, by name.

        The scene is relative to `world_center`, so that rounding is the same in all groups.
        """
        self._world_center, self._meshes = world_center, meshes
        corners = np.concatenate([mesh.vertices for mesh in meshes.values()])
        self._low, self._high = corners.min(axis=0), corners.max(axis=0)
        x, y, z = ((self._low + self._high) / 2).tolist()
        self._center = x, y, z
        self._radius = 1.001 * float(np.linalg.norm(corners - self._center, axis=1).max())
        self._scene: MeshScene | None = None
        self._heights: HeightRange | None = None

    def split_to_limit(self) -> Iterator["RestingGroup"]:
        """Yield this group or, if it has more than MAX_GROUP_TRIANGLES, smaller groups of its bodies."""
        if len(self._meshes) == 1 or sum(len(mesh.faces) for mesh in self._meshes.values()) <= MAX_GROUP_TRIANGLES:
            yield self
        else:
            for half in self._halves():
                yield from half.split_to_limit()

    def split_without(self, removed: Set[str]) -> Iterator["RestingGroup"]:
        """Yield this group if it has none of the `removed` bodies, otherwise smaller groups of the other bodies.

        The group is halved repeatedly, so that the next removal affects a smaller group.
        """
        if removed.isdisjoint(self._meshes):
            yield self
        elif not removed >= self._meshes.keys():
            for half in self._halves():
                yield from half.split_without(removed)

    def _halves(self) -> Iterator["RestingGroup"]:
        """Yield two groups with half of the bodies each, divided along the longest side of the bounding box."""
        along = int((self._high - self._low).argmax())
        names = sorted(self._meshes, key=lambda name: (self._meshes[name].vertices[:, along].mean(), name))
        for half_names in (names[: len(names) // 2], names[len(names) // 2 :]):
            yield RestingGroup(self._world_center, {name: self._meshes[name] for name in half_names})

    def _scene_between(self, heights: HeightRange) -> MeshScene:
        """Return the scene of the triangles between two heights. It is kept until the heights change."""
        if self._scene is None or heights != self._heights:
            whole = concatenate_meshes(list(self._meshes.values()))
            near = submesh_between_heights(whole.vertices, whole.faces, heights)
            self._scene = MeshScene(near, self._world_center)
            self._heights = heights
        return self._scene

    def min_distance(self, position: Vector) -> float:
        """Return a lower bound of the distance in m from a position to any of the bodies."""
        return math.dist(self._center, position) - self._radius

    def sweep(self, fan: RayFan, pose: Pose3, heights: HeightRange) -> None:
        """Shorten the rays of a fan; see `RestingBodies.sweep`."""
        for packets in packets_towards_sphere(fan, pose, self._center, self._radius):
            self._scene_between(heights).sweep(fan, pose[:3], packets)

    def cast(self, origins: Array, directions: Array, heights: HeightRange, lengths: Float32Array) -> None:
        """Shorten single rays; see `RestingBodies.cast`."""
        rays = rays_hitting_sphere(self._center, self._radius, origins, directions, lengths)
        if len(rays):
            lengths[rays] = self._scene_between(heights).distances(origins[rays], directions[rays], lengths[rays])


class RayScene(RayCaster):
    """A `core.geometry.ray_fans.RayCaster` over the triangles of a world and of the bodies in it.

    For moving bodies, rays are transformed to the frame of the body. For resting bodies, triangles are transformed to
    the world frame. Distances agree with PyBullet's rays within 1 mm.
    """

    def __init__(self, static: "TriangleMesh | RayScene") -> None:
        """Create a scene with the static mesh of a world, or with the static mesh of another scene."""
        self._static: MeshScene = static._static if isinstance(static, RayScene) else cached_mesh_scene(static)
        self._movers: dict[str, MovingMesh] = {}
        self._resting = RestingBodies(self._static.center)
        self._heights = math.inf, -math.inf

    def set_bodies(self, bodies: Mapping[str, PlacedMesh], rest_poses: Mapping[str, Pose3]) -> None:
        """Set all bodies that exist now, by name; others are removed.

        A body counts as resting if its pose equals its pose in `rest_poses`, otherwise as moving.
        """
        previous, self._movers = self._movers, {}
        resting = dict[str, PlacedMesh]()
        for name, (mesh, pose) in bodies.items():
            if rest_poses.get(name) == pose:
                resting[name] = mesh, pose
                continue
            mover = previous.get(name)
            if mover is None or mover.mesh is not mesh:
                mover = MovingMesh(mesh, cached_mesh_scene(mesh), pose)
            elif mover.pose != pose:
                mover = MovingMesh(mesh, mover.scene, pose)
            self._movers[name] = mover
        if resting or self._resting:
            self._resting.set_bodies(resting)

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """Return distances (n,) in m along unit `directions` (n, 3) from `origins` (n, 3); inf beyond `reach`."""
        limit = min(reach, _MAX_RANGE_M)
        if not len(origins):
            return np.empty(0)
        distances = self._first_hits(origins, directions, reach, limit * _INITIAL_LENGTH_RATIO)
        result = distances.astype(np.float64)
        result[distances > limit] = np.inf
        return result

    def sweep(self, fan: RayFan, pose: Pose3, reach: float) -> Float32Array:
        """Return the distances (n,) in m of a fan with its frame at `pose`. Values beyond `reach` mean no hit."""
        position, (ahead, left) = pose[:3], forward_and_left(pose[3:])
        fan.set_directions(ahead, left)
        fan.set_length(min(reach, _MAX_RANGE_M) * _INITIAL_LENGTH_RATIO)
        self._static.sweep(fan, position)
        if self._resting:
            rise = _max_rise(math.hypot(ahead[2], left[2]), reach)
            self._resting.sweep(fan, pose, reach, self._height_range(position[2] - rise, position[2] + rise))
        for mover in self._movers.values():
            if mover.min_distance(position) <= reach:
                mover.sweep(fan, pose, (ahead, left))
        return fan.rays.distances()

    def _first_hits(self, origins: Array, directions: Array, reach: float, length: float) -> Float32Array:
        """Return the distances (n,) in m to the first hits of single rays; `length` without a hit within `reach` m."""
        x, y, z = origins[0].tolist()
        reach += float(np.linalg.norm(origins - (x, y, z), axis=1).max())
        lengths = self._static.distances(origins, directions, length)
        if self._resting:
            low, high = origins[:, 2].min(), origins[:, 2].max()
            down, up = directions[:, 2].min(), directions[:, 2].max()
            heights = self._height_range(low - _max_rise(-down, reach), high + _max_rise(up, reach))
            self._resting.cast(origins, directions, heights, lengths)
        for mover in self._movers.values():
            if mover.min_distance((x, y, z)) <= reach:
                rays = rays_hitting_sphere(mover.center, mover.scene.radius, origins, directions, lengths)
                if len(rays):
                    lengths[rays] = mover.distances(origins[rays], directions[rays], lengths[rays])
        return lengths

    def _height_range(self, low: float, high: float) -> HeightRange:
        """Return a height range that contains all heights from `low` to `high` in m.

        The previous range is kept if possible, because a new range requires new scenes.
        """
        below, above = self._heights
        if not (below <= low - _ROUNDING_MARGIN_M and high + _ROUNDING_MARGIN_M <= above):
            low, high = min(low, below), max(high, above)
            margin = max(_HEIGHT_MARGIN_M, high - low)  # a lidar that tilts more and more needs only a few new ranges
            self._heights = low - margin, high + margin
        return self._heights


def _max_rise(slope: float, reach: float) -> float:
    """Return the height in m that a ray of `reach` m gains at most; `slope` is the z component of its unit vector."""
    return slope * reach if slope > 0 else 0.0
