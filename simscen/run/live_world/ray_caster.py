"""Ray casting for lidars against the static world and all moving objects at their current poses."""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.geometry.ray_fans import Float32Array, RayCaster, RayFan
from simscen.core.geometry.scripted_poses import PosesAtTick, PredictedPoses
from simscen.core.geometry.shapes import Body, Shape, TriangleMesh
from simscen.sim.robots.robot import Robot
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.raycasting.ray_scene import RayScene

REFRESH_DISTANCE_M = 4.0
"""Distance that a sensor can move until the list of the objects in reach is computed again."""


class LiveRayCaster(RayCaster):
    """Ray caster for the sensors of a robot. Before each cast, it updates the poses of the moving objects in reach."""

    def __init__(self, scene: RayScene, robot: Robot, ignored_names: frozenset[str] = frozenset()) -> None:
        """Cast rays for a robot in the static world `scene`. Rays pass through moving objects in `ignored_names`."""
        self._scene, self._robot, self._ignored_names = scene, robot, ignored_names
        self._bodies: Mapping[str, Body] | None = None
        self._meshes: dict[str, TriangleMesh] = {}
        self._extent = 0.0
        """Largest distance in m of a point of a moving object from the origin of the object."""
        self._reachable: ReachableObjects | None = None
        self._state: tuple[Iterable[str], Mapping[str, Pose3], Mapping[str, Pose3]] | None = None
        """Names, poses, and rest poses of the objects at the last update of the scene."""

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """Return distances (n,) in m along unit `directions` (n, 3) from `origins` (n, 3); inf beyond `reach` m."""
        self._update_scene((0.0, 0.0, 0.0), math.inf)
        return self._scene.cast(origins, directions, reach)

    def sweep(self, fan: RayFan, pose: Pose3, reach: float) -> Float32Array:
        """Return the distances (n,) in m along the rays of a fan at `pose`; values beyond `reach` m mean no hit."""
        self._update_scene(pose[:3], reach)
        return self._scene.sweep(fan, pose, reach)

    def _update_scene(self, origin: Vector, reach: float) -> None:
        robot, state = self._robot, self._state
        if robot.bodies is not self._bodies:  # the same object until a body is added or removed
            self._meshes, self._bodies = self._build_meshes(robot.bodies), robot.bodies
            self._extent = max([_extent(mesh) for mesh in self._meshes.values()], default=0.0)
            self._reachable = state = None
        poses, rest_poses = robot.objects(), robot.rest_poses
        names = self._reachable_names(poses.predicted, origin, reach) if type(poses) is PosesAtTick else self._meshes
        # Identical objects mean that nothing has moved.
        if state is None or names is not state[0] or poses is not state[1] or rest_poses is not state[2]:
            self._state = names, poses, rest_poses
            self._scene.set_bodies({name: (self._meshes[name], poses[name]) for name in names}, rest_poses)

    def _reachable_names(self, predicted: PredictedPoses, origin: Vector, reach: float) -> Iterable[str]:
        """Return the names of the objects that can be within `reach` m of `origin`, according to predicted poses."""
        reachable = self._reachable
        if reachable is None or not reachable.is_valid_for(predicted, origin, reach):
            # 1 % more, because rays end slightly beyond their reach.
            unreachable = predicted.farther_than(origin, 1.01 * (reach + REFRESH_DISTANCE_M + self._extent))
            names = [name for name in self._meshes if name not in unreachable]
            reachable = self._reachable = ReachableObjects(predicted, origin, reach + REFRESH_DISTANCE_M, names)
        return reachable.names

    def _build_meshes(self, bodies: Mapping[str, Body]) -> dict[str, TriangleMesh]:
        """Return the surface of each body by name. Bodies of equal shape share one mesh."""
        previous = self._bodies or {}
        known = [(_parts(previous[name]), mesh) for name, mesh in self._meshes.items()]
        meshes = dict[str, TriangleMesh]()
        for name, body in bodies.items():
            if name not in self._ignored_names:
                parts = _parts(body)
                shared = next((mesh for others, mesh in known if others == parts), None)
                meshes[name] = merge_solids(body.solids) if shared is None else shared
                known.append((parts, meshes[name]))
        return meshes


class ReachableObjects(NamedTuple):
    """Names of all moving objects that can be within `reach` m of `origin`, according to `predicted` poses."""

    predicted: PredictedPoses
    origin: Vector
    reach: float
    names: list[str]

    def is_valid_for(self, predicted: PredictedPoses, origin: Vector, reach: float) -> bool:
        """Return whether `names` contains all objects that rays from another origin with another reach can hit."""
        return predicted is self.predicted and math.dist(origin, self.origin) + reach <= self.reach


def _parts(body: Body) -> list[tuple[Shape, Pose3]]:
    return [(solid.shape, solid.pose) for solid in body.solids]


def _extent(mesh: TriangleMesh) -> float:
    """Return the largest distance in m of a vertex from the origin of the mesh."""
    return math.sqrt(float((mesh.vertices**2).sum(axis=1).max(initial=0.0)))
