"""What a robot's rays meet, wherever everything is when they are cast."""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.geometry.ray_fans import RayCaster, RayFan, Singles
from simscen.core.geometry.scripted_poses import PosesAtTick, PredictedPoses
from simscen.core.geometry.shapes import Body, Shape, TriangleMesh
from simscen.sim.robot import Robot
from simscen.worlds.meshing import fuse
from simscen.worlds.rays import RayScene

REFRESH_DISTANCE_M = 4.0
"""m that rays may begin elsewhere before what scripts move is looked through again."""


class LiveRayCaster(RayCaster):
    """Rays of a robot against the static world and against everything else that moves, where it is now."""

    def __init__(self, scene: RayScene, robot: Robot, without: frozenset[str] = frozenset()) -> None:
        """Of what moves, the rays go through what is called as in `without`."""
        self._scene, self._robot, self._without = scene, robot, without
        self._bodies: Mapping[str, Body] | None = None
        self._meshes: dict[str, TriangleMesh] = {}
        self._extent = 0.0
        self._near: ReachableObjects | None = None
        self._looked: tuple[Iterable[str], Mapping[str, Pose3], Mapping[str, Pose3]] | None = None

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """See core.rays.RayCaster."""
        self._look((0.0, 0.0, 0.0), math.inf)
        return self._scene.cast(origins, directions, reach)

    def sweep(self, fan: RayFan, pose: Pose3, reach: float) -> Singles:
        """See core.rays.RayCaster."""
        self._look(pose[:3], reach)
        return self._scene.sweep(fan, pose, reach)

    def _look(self, place: Vector, reach: float) -> None:
        """See where everything is now that rays from a place may meet within their reach."""
        robot, looked = self._robot, self._looked
        if robot.bodies is not self._bodies:  # it is the same one for as long as nothing comes or goes
            self._meshes, self._bodies = self._surfaces(robot.bodies), robot.bodies
            self._extent = max([_extent(mesh) for mesh in self._meshes.values()], default=0.0)
            self._near = looked = None
        where, homes = robot.objects(), robot.homes
        names = self._names(where.foreseen, place, reach) if type(where) is PosesAtTick else self._meshes
        # The same ones for as long as nothing has moved.
        if looked is None or names is not looked[0] or where is not looked[1] or homes is not looked[2]:
            self._looked = names, where, homes
            self._scene.set_moving({name: (self._meshes[name], where[name]) for name in names}, homes)

    def _names(self, foreseen: PredictedPoses, place: Vector, reach: float) -> Iterable[str]:
        """All but those that scripts keep out of reach."""
        near = self._near
        if near is None or not near.holds(foreseen, place, reach):
            # A little more, for rays end a little beyond their reach.
            far = foreseen.far(place, 1.01 * (reach + REFRESH_DISTANCE_M + self._extent))
            names = [name for name in self._meshes if name not in far]
            near = self._near = ReachableObjects(foreseen, place, reach + REFRESH_DISTANCE_M, names)
        return near.names

    def _surfaces(self, bodies: Mapping[str, Body]) -> dict[str, TriangleMesh]:
        """By name, the surface of each, which is the same one for all that are alike: a row of chairs is built once."""
        before = self._bodies or {}
        known = [(_parts(before[name]), mesh) for name, mesh in self._meshes.items()]
        meshes = dict[str, TriangleMesh]()
        for name, body in bodies.items():
            if name not in self._without:
                parts = _parts(body)
                alike = next((surface for others, surface in known if others == parts), None)
                meshes[name] = fuse(body.solids) if alike is None else alike
                known.append((parts, meshes[name]))
        return meshes


class ReachableObjects(NamedTuple):
    """What rays from a place may meet within their reach for as long as scripts are `foreseen`."""

    foreseen: PredictedPoses
    place: Vector
    reach: float
    names: list[str]

    def holds(self, foreseen: PredictedPoses, place: Vector, reach: float) -> bool:
        """Whether rays from another place meet no others."""
        return foreseen is self.foreseen and math.dist(place, self.place) + reach <= self.reach


def _parts(body: Body) -> list[tuple[Shape, Pose3]]:
    """What it is made of, whatever that is called."""
    return [(solid.shape, solid.pose) for solid in body.solids]


def _extent(mesh: TriangleMesh) -> float:
    """How far in metres it reaches from the origin of its frame."""
    return math.sqrt(float((mesh.vertices**2).sum(axis=1).max(initial=0.0)))
