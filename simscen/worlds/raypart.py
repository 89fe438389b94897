"""Embree scenes: of a mesh, of such a mesh where it is now, and of what is around in a large world."""

import math

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh as EmbreeMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

from simscen.core.facelots import FaceLots, lots_of
from simscen.core.facemesh import between
from simscen.core.geometry import Array, Pose3, Vector, rotated
from simscen.core.rays import Fan, Singles
from simscen.core.remembered import remembered
from simscen.core.shapes import Mesh, TriangleMesh

Heights = tuple[float, float]
"""m between which rays stay."""
Numbers = npt.NDArray[np.int64]

EDGE, AHEAD = 4.0, 8.0
"""m of the squares that large worlds are taken in, and beyond the reach of rays within which they are."""


class Part:
    """One Embree scene of a mesh, about the middle of that mesh.

    `radius` is that of the sphere around it, `extent` how far it reaches from the origin of its frame.
    """

    def __init__(self, device: EmbreeDevice, mesh: TriangleMesh | Mesh, middle: Array | None = None) -> None:
        """About a `middle` of something larger, if that is given."""
        self.mesh = mesh
        self.middle = middle_of(mesh.vertices) if middle is None else middle
        x, y, z = self.middle.tolist()
        self.centre = (x, y, z)
        corners = mesh.vertices - self.middle
        # A little more, for rays that graze the furthest corner.
        self.radius = 1.001 * float(np.linalg.norm(corners, axis=1).max(initial=0.0))
        self.extent = math.hypot(x, y, z) + self.radius
        # Robust: without it rays may slip through the edge between two triangles.
        self._scene = EmbreeScene(device, True)
        if len(mesh.faces):
            # It reads arrays number by number, and takes half as long for one from a list as for one from a row.
            EmbreeMesh(self._scene, corners, np.fromiter(mesh.faces.tolist(), np.object_, len(mesh.faces)))

    def distances(self, origins: Array, directions: Array, ends: float | Singles) -> Singles:
        """Distances (n,) in the mesh's own frame; where nothing is hit before a ray ends, that of its end.

        An array of `ends` becomes the answer.
        """
        starts = np.subtract(origins, self.middle).astype(np.float32)
        along = np.ascontiguousarray(directions, dtype=np.float32)
        answer: Singles = self._scene.run(starts, along, ends, query="DISTANCE")
        return answer

    def sweep(self, fan: Fan, place: Vector, ends: float) -> Singles:
        """The same of a fan of rays that begin in a place and point where they were turned to."""
        (x, y, z), (mx, my, mz) = place, self.centre
        fan.begin(x - mx, y - my, z - mz)
        answer: Singles = self._scene.run(fan.starts, fan.directions, ends, query="DISTANCE")
        return answer

    def sweep_some(self, fan: Fan, rays: slice, place: Vector, ends: Singles) -> None:
        """Some of a fan's rays alone: what they meet before their `ends` becomes their ends."""
        (x, y, z), (mx, my, mz) = place, self.centre
        fan.begin(x - mx, y - my, z - mz)
        self._scene.run(fan.starts[rays], fan.directions[rays], ends, query="DISTANCE")


class Mover:
    """A part where it is now; what rays need to know of that is worked out once one may meet it."""

    def __init__(self, part: Part, pose: Pose3) -> None:
        """With its frame at a pose in the world."""
        self.part, self.pose = part, pose
        self._middle: Vector | None = None
        self._rotation: Array | None = None

    @property
    def middle(self) -> Vector:
        """Where its middle is in the world."""
        if self._middle is None:
            x, y, z, i, j, k, w = self.pose
            p, q, r = rotated((i, j, k, w), self.part.centre)
            self._middle = x + p, y + q, z + r
        return self._middle

    @property
    def _turn(self) -> Array:
        if self._rotation is None:
            self._rotation = self.pose.rotation()
        return self._rotation

    def away(self, place: Vector) -> float:
        """How far in metres from a place in the world the nearest of it may be."""
        return math.dist(self.pose[:3], place) - self.part.extent

    def distances(self, origins: Array, directions: Array, ends: Singles) -> Singles:
        """As those of a part, in the world."""
        turn = self._turn
        return self.part.distances((origins - self.pose[:3]) @ turn, directions @ turn, ends)

    def sweep(self, fan: Fan, pose: Pose3, axes: tuple[Vector, Vector], ends: Singles) -> None:
        """What rays meet before their `ends` (n,) becomes these, of a fan at `pose` whose x and y axes are `axes`.

        It is asked for those within the cone about the sphere around it, if any goes as far.
        """
        for rays, before in towards(fan, pose, self.middle, self.part.radius, ends):
            self._cut(fan, rays, pose, axes, before)

    def _cut(self, fan: Fan, rays: slice, pose: Pose3, axes: tuple[Vector, Vector], ends: Singles) -> None:
        (px, py, pz, *_), (ahead, left), (x, y, z, i, j, k, w) = pose, axes, self.pose
        back = -i, -j, -k, w
        fan.turn(rotated(back, ahead), rotated(back, left), rays)
        self.part.sweep_some(fan, rays, rotated(back, (px - x, py - y, pz - z)), ends)


def towards(fan: Fan, pose: Pose3, middle: Vector, radius: float, ends: Singles) -> list[tuple[slice, Singles]]:
    """The rays of a fan at `pose` within the cone about a sphere, and their ends, if any of them goes as far."""
    (x, y, z), (px, py, pz, i, j, k, w) = middle, pose
    way = x - px, y - py, z - pz
    far = math.hypot(*way)
    ahead, left, _ = rotated((-i, -j, -k, w), way)
    cone = fan.towards(ahead, left, math.sqrt(far * far - radius * radius) if far > radius else -math.inf)
    found = [(rays, ends[rays]) for rays in cone]
    # `max` takes ten times as long.
    return [(rays, some) for rays, some in found if some[some.argmax()] >= far - radius]


def meeting(middle: Vector, radius: float, origins: Array, directions: Array, ends: Singles) -> Numbers:
    """Which rays (n,) from several places meet a sphere before they end."""
    ways = middle - origins
    ahead = (ways * directions).sum(axis=1)
    beside = (ways * ways).sum(axis=1) - ahead**2
    met: Numbers = ((ahead >= -radius) & (ahead - radius <= ends) & (beside <= radius * radius)).nonzero()[0]
    return met


class Window:
    """The world of a mesh about the place that rays were last cast from, and at their heights.

    Of a large one most is out of their reach, and of what is not, from a quarter to most is above or below them.
    Embree takes half a microsecond for each triangle, and some 200 bytes. Those around are where all of them would be.
    """

    def __init__(self, device: EmbreeDevice, mesh: TriangleMesh) -> None:
        self.mesh = mesh
        self._device, self.middle = device, _middle_of(mesh)
        self._part: Part | None = None
        self._place, self._far = (0.0, 0.0), 0.0
        self._heights: Heights | None = None

    def around(self, place: Vector, reach: float, heights: Heights) -> Part:
        """A scene that holds all that rays from a place may meet within their reach."""
        x, y, _ = place
        dx, dy = x - self._place[0], y - self._place[1]
        away = math.hypot(dx, dy)
        if self._part is None or away + reach > self._far or heights != self._heights:
            # Who has come from the last middle mostly goes on: half of what is taken beyond the reach lies before it.
            onward = min(1.0, AHEAD / 2 / away) if self._part is not None and away > 0 else 0.0
            self._heights = heights
            self._place, self._far = (x + onward * dx, y + onward * dy), reach + AHEAD
            lots = _lots_of(self.mesh)
            near = np.flatnonzero(lots.near(*self._place, self._far)).tolist()
            faces = np.concatenate([np.empty((0, 3), np.int32), *(lots.lot(number) for number in near)])
            self._part = Part(self._device, between(self.mesh.vertices, faces, heights), self.middle)
        return self._part


def middle_of(vertices: Array) -> Array:
    """The middle of the box around vertices (n, 3)."""
    if not len(vertices):
        return np.zeros(3)
    middle: Array = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return middle


def ready(mesh: TriangleMesh) -> None:
    """Work out now what windows of a world need to know of it."""
    _middle_of(mesh)
    _lots_of(mesh)


@remembered
def _middle_of(mesh: TriangleMesh) -> Array:
    return middle_of(mesh.vertices)


@remembered
def _lots_of(mesh: TriangleMesh) -> FaceLots:
    return lots_of(mesh.vertices, mesh.faces, EDGE)
