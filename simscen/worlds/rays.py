"""Ray casting with Embree: one scene for what never moves, and one for each thing that does, in its own frame."""

import math
from collections.abc import Mapping
from weakref import WeakValueDictionary

import numpy as np
import numpy.typing as npt
from embreex.rtcore import EmbreeDevice

from simscen.core.geometry import Array, Pose3, forward_and_left
from simscen.core.rays import Fan, RayCaster, Singles
from simscen.core.shapes import TriangleMesh
from simscen.worlds import raypart
from simscen.worlds.raypart import Mover, Part, Window

Numbers = npt.NDArray[np.int64]
Placed = tuple[TriangleMesh, Pose3]

FEW = 20_000
"""Triangles of a world that is taken as a whole, in 25 ms."""
_FARTHEST = 1e30
"""m that a ray reaches at most, in single precision."""
_BEYOND = 1.001
"""Times its reach, where a ray ends that meets nothing within it."""


class RayScene(RayCaster):
    """A `core.rays.RayCaster` over the triangles of a world and of the bodies that move in it.

    A body that moves stays as it was built; the few rays that come near it are carried into its frame. Distances agree
    with PyBullet's rays within 1 mm. Embree works in single precision, so everything is kept about its own centre: a
    world that lies 10 km from the origin loses nothing, one that is itself 10 km wide half a millimetre. Make a scene
    in the process that uses it: Embree's threads do not survive a fork.
    """

    def __init__(self, static: "TriangleMesh | RayScene") -> None:
        """Of a world; or of that of another scene, which is then built once for both."""
        self._device: EmbreeDevice = static._device if isinstance(static, RayScene) else EmbreeDevice()
        if isinstance(static, RayScene):
            world = static._static
            self._static: Part | Window = Window(self._device, world.mesh) if isinstance(world, Window) else world
        else:
            self._static = (Window if len(static.faces) > FEW else Part)(self._device, static)
        self._parts = WeakValueDictionary[int, Part]()
        self._movers: dict[str, Mover] = {}

    def set_moving(self, bodies: Mapping[str, Placed]) -> None:
        """Say where the bodies are now: by name, the triangles in a body's frame and the pose of that frame."""
        before, self._movers = self._movers, {}
        for name, (mesh, pose) in bodies.items():
            mover = before.get(name)
            if mover is None or mover.part.mesh is not mesh:
                mover = Mover(self._part_of(mesh), pose)
            elif mover.pose != pose:
                mover = Mover(mover.part, pose)
            self._movers[name] = mover

    def _part_of(self, mesh: TriangleMesh) -> Part:
        """The scene of a mesh, which is one for all that are alike; those of what is gone are forgotten with it."""
        part = self._parts.get(id(mesh))
        if part is None:
            part = self._parts[id(mesh)] = Part(self._device, mesh)
        return part

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """See core.rays.RayCaster."""
        limit = min(reach, _FARTHEST)
        if not len(origins):
            return np.empty(0)
        distances = self._from_each(origins, directions, reach, limit * _BEYOND)
        answer = distances.astype(np.float64)
        answer[distances > limit] = np.inf
        return answer

    def sweep(self, fan: Fan, pose: Pose3, reach: float) -> Singles:
        """See core.rays.RayCaster: with as few operations as may be, for each takes 1 µs where it runs once a scan."""
        place, ahead_and_left = pose[:3], forward_and_left(pose[3:])
        fan.turn(*ahead_and_left)
        static = self._static.around(place, reach) if isinstance(self._static, Window) else self._static
        ends = static.sweep(fan, place, min(reach, _FARTHEST) * _BEYOND)
        for mover in self._movers.values():
            if mover.away(place) <= reach:
                mover.sweep(fan, pose, ahead_and_left, ends)
        return ends

    def _from_each(self, origins: Array, directions: Array, reach: float, end: float) -> Singles:
        """Where rays meet anything that begin in places of their own."""
        x, y, z = origins[0].tolist()
        reach += float(np.linalg.norm(origins - (x, y, z), axis=1).max())
        static = self._static.around((x, y, z), reach) if isinstance(self._static, Window) else self._static
        ends = static.distances(origins, directions, end)
        for mover in self._movers.values():
            if mover.away((x, y, z)) <= reach:
                rays: Numbers = _meeting(mover, origins, directions, ends).nonzero()[0]
                if len(rays):
                    ends[rays] = mover.distances(origins[rays], directions[rays], ends[rays])
        return ends


def _meeting(mover: Mover, origins: Array, directions: Array, ends: Singles) -> npt.NDArray[np.bool_]:
    """Which rays (n,) from several places meet the sphere around a mover before they end."""
    ways, radius = mover.middle - origins, mover.part.radius
    ahead = (ways * directions).sum(axis=1)
    beside = (ways * ways).sum(axis=1) - ahead**2
    met: npt.NDArray[np.bool_] = (ahead >= -radius) & (ahead - radius <= ends) & (beside <= radius * radius)
    return met


def ready(mesh: TriangleMesh) -> None:
    """Work out now what scenes of a world need to know of it."""
    if len(mesh.faces) > FEW:
        raypart.ready(mesh)
