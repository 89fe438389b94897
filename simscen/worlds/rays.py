"""Ray casting with Embree: one scene for what never moves, and one for each thing that does, in its own frame."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from embreex.rtcore import EmbreeDevice

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.shapes import TriangleMesh
from simscen.worlds import raypart
from simscen.worlds.raypart import Mover, Part, Singles, Window

Numbers = npt.NDArray[np.int64]
Placed = tuple[TriangleMesh, Pose3]

FEW = 20_000
"""Triangles of a world that is taken as a whole, in 25 ms."""
_FARTHEST = 1e30
"""m that a ray reaches at most, in single precision."""
_BEYOND = 1.001
"""Times its reach, where a ray ends that meets nothing within it."""


class RayScene:
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
        self._parts: dict[int, Part] = {}
        self._movers: dict[str, Mover] = {}

    def set_moving(self, bodies: Mapping[str, Placed]) -> None:
        """Say where the bodies are now: by name, the triangles in a body's frame and the pose of that frame."""
        known, self._parts = self._parts, {}
        before, self._movers = self._movers, {}
        for name, (mesh, pose) in bodies.items():
            part = self._parts.get(id(mesh)) or known.get(id(mesh)) or Part(self._device, mesh)
            self._parts[id(mesh)] = part
            mover = before.get(name)
            same = mover is not None and mover.part is part and mover.pose == pose
            self._movers[name] = mover if mover is not None and same else Mover(part, pose)

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """See core.rays.RayCaster."""
        static, limit = self._static, min(reach, _FARTHEST)
        if isinstance(static, Window):
            static = static.around(origins, reach)
        distances = static.distances(origins, directions, limit * _BEYOND)
        if self._movers and len(origins):
            self._shorten(origins, directions, distances, reach)
        answer = distances.astype(np.float64)
        answer[distances > limit] = np.inf
        return answer

    def _shorten(self, origins: Array, directions: Array, ends: Singles, reach: float) -> None:
        """Let rays end where they meet moving bodies; those are asked for that meet the sphere around one."""
        place = origins[0].tolist()
        if origins.strides[0]:
            reach += float(np.linalg.norm(origins - origins[0], axis=1).max())
        movers = self._movers.values()
        near = [mover for mover in movers if math.dist(mover.pose[:3], place) - mover.part.extent <= reach]
        if not near:
            return
        meeting = _meeting if origins.strides[0] else _in_cones
        for mover, met in zip(near, meeting(near, origins, directions, ends), strict=True):
            rays: Numbers = met.nonzero()[0]
            if len(rays):
                starts = origins[rays] if origins.strides[0] else origins[: len(rays)]
                ends[rays] = mover.distances(starts, directions[rays], ends[rays])


def _in_cones(movers: Sequence[Mover], origins: Array, directions: Array, ends: Singles) -> npt.NDArray[np.bool_]:
    """Which rays (k, n) from one place meet the sphere around each mover; all where they begin inside of it."""
    px, py, pz = origins[0].tolist()
    ways, least, away = list[Vector](), list[tuple[float]](), list[tuple[float]]()
    for mover in movers:
        (x, y, z), radius = mover.middle, mover.part.radius
        x, y, z = x - px, y - py, z - pz
        square = x * x + y * y + z * z
        outside = square - radius * radius
        ways.append((x, y, z))
        least.append((math.sqrt(outside) if outside > 0 else -math.inf,))
        away.append((math.sqrt(square) - radius,))
    chosen: npt.NDArray[np.bool_] = np.array(ways) @ directions.T >= np.array(least)
    chosen &= ends >= np.array(away)
    return chosen


def _meeting(movers: Sequence[Mover], origins: Array, directions: Array, ends: Singles) -> npt.NDArray[np.bool_]:
    """Which rays (k, n) from several places meet the sphere around each mover before they end."""
    chosen = np.empty((len(movers), len(origins)), dtype=np.bool_)
    for mover, met in zip(movers, chosen, strict=True):
        ways, radius = mover.middle - origins, mover.part.radius
        ahead = (ways * directions).sum(axis=1)
        beside = (ways * ways).sum(axis=1) - ahead**2
        met[:] = (ahead >= -radius) & (ahead - radius <= ends) & (beside <= radius * radius)
    return chosen


def ready(mesh: TriangleMesh) -> None:
    """Work out now what scenes of a world need to know of it."""
    if len(mesh.faces) > FEW:
        raypart.ready(mesh)
