"""Ray casting with Embree: one scene for what never moves, and one for each thing that does, in its own frame."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

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
        self._movers: dict[str, _Mover] = {}

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
            for mover, rays in self._met(origins, directions, np.minimum(distances, reach)):
                distances[rays] = np.minimum(distances[rays], mover.distances(origins[rays], directions[rays]))
        answer = distances.astype(np.float64)
        answer[distances > limit] = np.inf
        return answer

    def _near(self, origins: Array, ends: Singles) -> "list[_Mover]":
        """The moving bodies that are no farther from where the rays begin than the longest of them is."""
        place, far = origins[0].tolist(), float(ends.max())
        if origins.strides[0]:
            far += float(np.linalg.norm(origins - origins[0], axis=1).max())
        known, self._movers = self._movers, {}
        for name, (mesh, pose) in self._bodies.items():
            part = self._parts[id(mesh)]
            if len(mesh.faces) and math.dist(pose.position, place) <= far + part.extent:
                mover = known.get(name)
                if mover is None or mover.part is not part or mover.pose != pose:
                    mover = _Mover(part, pose)
                self._movers[name] = mover
        return list(self._movers.values())

    def _met(
        self, origins: Array, directions: Array, ends: Singles
    ) -> Iterator[tuple["_Mover", npt.NDArray[np.int64]]]:
        """The moving bodies and the numbers of the rays that meet the sphere around them before they end."""
        movers = self._near(origins, ends)
        if not movers:
            return
        if not origins.strides[0]:  # all from one place, as a lidar's
            yield from _met_from(origins[0].tolist(), directions, ends, movers)
            return
        centres = np.array([mover.centre for mover in movers])
        radii = np.array([[mover.part.radius] for mover in movers])
        ahead = centres @ directions.T - (origins * directions).sum(axis=1)
        away = (centres**2).sum(axis=1)[:, np.newaxis] - 2 * (centres @ origins.T) + (origins**2).sum(axis=1)
        meets = (ahead >= -radii) & (ahead - radii <= ends) & (away - ahead**2 <= radii**2)
        for number in np.flatnonzero(meets.any(axis=1)):
            yield movers[number], np.flatnonzero(meets[number])


def _met_from(
    place: list[float], directions: Array, ends: Singles, movers: "list[_Mover]"
) -> Iterator[tuple["_Mover", npt.NDArray[np.int64]]]:
    """The same of rays that all begin at one place: they meet a sphere within a cone about its middle."""
    ways = [[c - p for c, p in zip(mover.centre, place, strict=True)] for mover in movers]
    beyond = [sum(w * w for w in way) - mover.part.radius**2 for way, mover in zip(ways, movers, strict=True)]
    # How far ahead the middle of a sphere has to be; a ray that begins inside of one meets it anyway.
    least = [[math.sqrt(square) if square > 0 else -math.inf] for square in beyond]
    ahead = np.array(ways) @ directions.T
    towards = ahead >= least
    for mover, near, each in zip(movers, towards, ahead, strict=True):
        rays = near.nonzero()[0]
        if len(rays):
            rays = rays[each[rays] - mover.part.radius <= ends[rays]]
            if len(rays):
                yield mover, rays


class _Part:
    """One Embree scene of a mesh, about the middle of that mesh; `radius` is that of the sphere around it.

    `extent` is how far it may be from the origin of its frame.
    """

    def __init__(self, device: EmbreeDevice, mesh: TriangleMesh | Mesh, middle: Array | None = None) -> None:
        """About a `middle` of something larger, if that is given."""
        self.middle = _middle(mesh.vertices) if middle is None else middle
        x, y, z = self.middle.tolist()
        self.centre = (x, y, z)
        corners = mesh.vertices - self.middle
        # A little more, for rays that graze the furthest corner.
        self.radius = 1.001 * float(np.linalg.norm(corners, axis=1).max(initial=0.0))
        self.extent = self.radius + float(np.linalg.norm(self.middle))
        # Robust: without it rays may slip through the edge between two triangles.
        self._scene = EmbreeScene(device, True)
        if len(mesh.faces):
            faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
            EmbreeMesh(self._scene, np.ascontiguousarray(corners, dtype=np.float32), faces)

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


@dataclass(frozen=True, eq=False)
class _Mover:
    """A body where it is now."""

    part: _Part
    pose: Pose3

    @cached_property
    def centre(self) -> Vector:
        """The middle of the body in the world."""
        x, y, z, *turn = self.pose
        p, q, r = rotated((turn[0], turn[1], turn[2], turn[3]), self.part.centre)
        return x + p, y + q, z + r

    @cached_property
    def _turn(self) -> Array:
        return self.pose.rotation()

    def distances(self, origins: Array, directions: Array) -> Singles:
        """As _Part.distances, of rays in the world."""
        return self.part.distances((origins - self.pose.position) @ self._turn, directions @ self._turn)


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
