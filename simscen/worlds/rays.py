"""Ray casting with Embree: one scene for what never moves, and one for each thing that does, in its own frame."""

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh as EmbreeMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

from simscen.core.facelots import FaceLots, lots_of
from simscen.core.facemesh import compact
from simscen.core.geometry import Array, Pose3, Vector, rotated
from simscen.core.remembered import remembered
from simscen.core.shapes import Mesh, TriangleMesh

Singles = npt.NDArray[np.float32]
Indices = npt.NDArray[np.int32]
Numbers = npt.NDArray[np.int64]
Placed = tuple[TriangleMesh, Pose3]

FEW = 20_000
"""Triangles of a world that is taken as a whole, in 25 ms."""
EDGE, AHEAD = 8.0, 8.0
"""m of the squares that others are taken in, and beyond the reach of rays within which they are."""
_NO_HIT = np.float32(1e30)
"""Embree answers 1e37 for a ray that meets nothing."""


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
            self._static: _Part | _Window = _Window(self._device, world.mesh) if isinstance(world, _Window) else world
        else:
            self._static = (_Window if len(static.faces) > FEW else _Part)(self._device, static)
        self._parts: dict[int, _Part] = {}
        self._bodies: Mapping[str, Placed] = {}

    def set_moving(self, bodies: Mapping[str, Placed]) -> None:
        """Say where the bodies are now: by name, the triangles in a body's frame and the pose of that frame."""
        known, self._parts = self._parts, {}
        for mesh, _ in bodies.values():
            if id(mesh) not in self._parts:
                self._parts[id(mesh)] = known.get(id(mesh)) or _Part(self._device, mesh)
        self._bodies = bodies

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """See core.rays.RayCaster."""
        static = self._static
        if isinstance(static, _Window):
            static = static.around(origins, reach)
        distances, limit = static.distances(origins, directions), min(reach, _NO_HIT)
        if self._bodies and len(origins):
            self._shorten(origins, directions, distances, reach)
        answer = distances.astype(np.float64)
        answer[distances > limit] = np.inf
        return answer

    def _shorten(self, origins: Array, directions: Array, ends: Singles, reach: float) -> None:
        """Let rays end where they meet moving bodies; those are asked for that meet the sphere around one."""
        place, far, one = origins[0].tolist(), min(float(ends.max()), reach), not origins.strides[0]
        if not one:
            far += float(np.linalg.norm(origins - origins[0], axis=1).max())
        for mesh, pose in self._bodies.values():
            part = self._parts[id(mesh)]
            centre = part.middle_at(pose)
            away = math.dist(centre, place) - part.radius
            if away > far or not len(mesh.faces):
                continue
            if one:  # as a lidar's
                way = [there - here for here, there in zip(place, centre, strict=True)]
                rays = _in_cone(way, part.radius, directions)
                rays = rays[ends[rays] >= away]
            else:
                rays = _meeting(centre - origins, part.radius, directions, ends)
            if len(rays):
                turn = pose.rotation()
                found = part.distances((origins[rays] - pose.position) @ turn, directions[rays] @ turn)
                ends[rays] = np.minimum(ends[rays], found)


def _in_cone(way: list[float], radius: float, directions: Array) -> Numbers:
    """The rays from one place that meet a sphere, whose middle is a `way` off; all where they begin inside of it."""
    square = sum([part * part for part in way]) - radius * radius
    chosen: Numbers = (directions @ way >= (math.sqrt(square) if square > 0 else -math.inf)).nonzero()[0]
    return chosen


def _meeting(ways: Array, radius: float, directions: Array, ends: Singles) -> Numbers:
    """The rays that meet a sphere before they end; `ways` (n, 3) lead from where each begins to its middle."""
    ahead = (ways * directions).sum(axis=1)
    beside = (ways * ways).sum(axis=1) - ahead**2
    chosen: Numbers = ((ahead >= -radius) & (ahead - radius <= ends) & (beside <= radius * radius)).nonzero()[0]
    return chosen


class _Part:
    """One Embree scene of a mesh, about the middle of that mesh; `radius` is that of the sphere around it."""

    def __init__(self, device: EmbreeDevice, mesh: TriangleMesh | Mesh, middle: Array | None = None) -> None:
        """About a `middle` of something larger, if that is given."""
        self.middle = _middle(mesh.vertices) if middle is None else middle
        x, y, z = self.middle.tolist()
        self._centre = (x, y, z)
        corners = mesh.vertices - self.middle
        # A little more, for rays that graze the furthest corner.
        self.radius = 1.001 * float(np.linalg.norm(corners, axis=1).max(initial=0.0))
        # Robust: without it rays may slip through the edge between two triangles.
        self._scene = EmbreeScene(device, True)
        if len(mesh.faces):
            faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
            EmbreeMesh(self._scene, np.ascontiguousarray(corners, dtype=np.float32), faces)

    def middle_at(self, pose: Pose3) -> Vector:
        """Where its middle is in the world, with its frame at a pose."""
        x, y, z, i, j, k, w = pose
        p, q, r = rotated((i, j, k, w), self._centre)
        return x + p, y + q, z + r

    def distances(self, origins: Array, directions: Array) -> Singles:
        """Distances (n,) in the mesh's own frame, beyond _NO_HIT where nothing is hit."""
        if origins.strides[0]:
            starts = np.subtract(origins, self.middle).astype(np.float32)
        else:
            starts = np.empty(origins.shape, np.float32)
            starts[:] = origins[0] - self.middle
        along = np.ascontiguousarray(directions, dtype=np.float32)
        answer: Singles = self._scene.run(starts, along, query="DISTANCE")
        return answer


class _Window:
    """The world of a mesh about the place that rays were last cast from: of a large one most is out of their reach.

    Embree takes a microsecond for each triangle, and some 200 bytes. Those around are where all of them would be.
    """

    def __init__(self, device: EmbreeDevice, mesh: TriangleMesh) -> None:
        self.mesh = mesh
        self._device, self._middle = device, _middle_of(mesh)
        self._part: _Part | None = None
        self._place, self._far = (0.0, 0.0), 0.0

    def around(self, origins: Array, reach: float) -> _Part:
        """A scene that holds all that rays from the origins (n, 3) may meet within their reach."""
        x, y = origins[0, :2].tolist() if len(origins) else self._place
        if len(origins) and origins.strides[0]:
            reach += float(np.abs(origins[:, :2] - origins[0, :2]).max())
        away = max(abs(x - self._place[0]), abs(y - self._place[1]))
        if self._part is None or away + reach > self._far:
            self._place, self._far = (x, y), reach + AHEAD
            lots = _lots_of(self.mesh)
            near = np.flatnonzero(lots.near(x, y, self._far)).tolist()
            faces = np.concatenate([np.empty((0, 3), np.int32), *(lots.lot(number) for number in near)])
            self._part = _Part(self._device, compact(self.mesh.vertices, faces), self._middle)
        return self._part


def _middle(vertices: Array) -> Array:
    if not len(vertices):
        return np.zeros(3)
    middle: Array = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return middle


def ready(mesh: TriangleMesh) -> None:
    """Work out now what scenes of a world need to know of it."""
    if len(mesh.faces) > FEW:
        _middle_of(mesh)
        _lots_of(mesh)


@remembered
def _middle_of(mesh: TriangleMesh) -> Array:
    return _middle(mesh.vertices)


@remembered
def _lots_of(mesh: TriangleMesh) -> FaceLots:
    return lots_of(mesh.vertices, mesh.faces, EDGE)
