"""Embree scenes: of a mesh, and of such a mesh where it is now."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array, Pose3, Vector, rotated
from simscen.core.geometry.ray_fans import ALL_PACKETS, PACKET_SIZE, RayFan, RayPackets, Singles
from simscen.core.geometry.shapes import Mesh, TriangleMesh
from simscen.worlds.raycasting.embree import Scene

Heights = tuple[float, float]
"""m between which rays stay."""
Numbers = npt.NDArray[np.int64]


class MeshScene:
    """One Embree scene of a mesh, about the middle of that mesh.

    `radius` is that of the sphere around it, `extent` how far it reaches from the origin of its frame.
    """

    def __init__(self, mesh: TriangleMesh | Mesh, middle: Array | None = None) -> None:
        """About a `middle` of something larger, if that is given."""
        self.middle = middle_of(mesh.vertices) if middle is None else middle
        x, y, z = self.middle.tolist()
        self.center = (x, y, z)
        corners = mesh.vertices - self.middle
        # A little more, for rays that graze the furthest corner.
        self.radius = 1.001 * float(np.linalg.norm(corners, axis=1).max(initial=0.0))
        self.extent = math.hypot(x, y, z) + self.radius
        self._scene = Scene(corners, mesh)

    def distances(self, origins: Array, directions: Array, ends: float | Singles) -> Singles:
        """Distances (n,) in the mesh's own frame; where nothing is hit before a ray ends, that of its end."""
        rays = RayPackets(len(origins))
        rays.put(origins - self.middle, directions, ends)
        self._scene.cut(rays)
        return rays.distances()

    def sweep(self, fan: RayFan, place: Vector, packets: slice = ALL_PACKETS) -> None:
        """The rays of a fan that begin in a place and point where they were turned to end at what they meet here.

        Of some `packets` of them alone.
        """
        (x, y, z), (mx, my, mz) = place, self.center
        fan.begin(x - mx, y - my, z - mz, packets)
        self._scene.cut(fan.rays, packets)


@cached_on_instance
def part_of(mesh: TriangleMesh) -> MeshScene:
    """The scene of a mesh, for all that ask, and for what is forked; it goes with the mesh."""
    return MeshScene(mesh)


class MovingMesh:
    """A part where it is now; what rays need to know of that is worked out once one may meet it."""

    def __init__(self, mesh: TriangleMesh, part: MeshScene, pose: Pose3) -> None:
        """That of a mesh, with its frame at a pose in the world."""
        self.mesh, self.part, self.pose = mesh, part, pose
        self._middle: Vector | None = None
        self._rotation: Array | None = None

    @property
    def middle(self) -> Vector:
        """Where its middle is in the world."""
        if self._middle is None:
            x, y, z, i, j, k, w = self.pose
            p, q, r = rotated((i, j, k, w), self.part.center)
            self._middle = x + p, y + q, z + r
        return self._middle

    @property
    def _turn(self) -> Array:
        if self._rotation is None:
            self._rotation = self.pose.rotation()
        return self._rotation

    def away(self, place: Vector) -> float:
        """How far in meters from a place in the world the nearest of it may be."""
        return math.dist(self.pose[:3], place) - self.part.extent

    def distances(self, origins: Array, directions: Array, ends: Singles) -> Singles:
        """As those of a part, in the world."""
        turn = self._turn
        return self.part.distances((origins - self.pose[:3]) @ turn, directions @ turn, ends)

    def sweep(self, fan: RayFan, pose: Pose3, axes: tuple[Vector, Vector]) -> None:
        """Rays of a fan at `pose`, whose x and y axes are `axes`, end at what they meet here.

        It is asked for those within the cone about the sphere around it, if any goes as far.
        """
        for packets in towards(fan, pose, self.middle, self.part.radius):
            self._cut(fan, packets, pose, axes)

    def _cut(self, fan: RayFan, packets: slice, pose: Pose3, axes: tuple[Vector, Vector]) -> None:
        (px, py, pz, *_), (ahead, left), (x, y, z, i, j, k, w) = pose, axes, self.pose
        back = -i, -j, -k, w
        fan.turn(rotated(back, ahead), rotated(back, left), packets)
        self.part.sweep(fan, rotated(back, (px - x, py - y, pz - z)), packets)


def towards(fan: RayFan, pose: Pose3, middle: Vector, radius: float) -> list[slice]:
    """The packets of a fan at `pose` with rays within the cone about a sphere, if any of them goes as far."""
    (x, y, z), (px, py, pz, i, j, k, w) = middle, pose
    way = x - px, y - py, z - pz
    far = math.hypot(*way)
    ahead, left, _ = rotated((-i, -j, -k, w), way)
    cone = fan.towards(ahead, left, math.sqrt(far * far - radius * radius) if far > radius else -math.inf)
    ends = fan.rays.ends
    found = [slice(rays.start // PACKET_SIZE, -(-rays.stop // PACKET_SIZE)) for rays in cone]
    # `max` takes ten times as long.
    return [packets for packets in found if (some := ends[packets]).item(some.argmax()) >= far - radius]


def meeting(middle: Vector, radius: float, origins: Array, directions: Array, ends: Singles) -> Numbers:
    """Which rays (n,) from several places meet a sphere before they end."""
    ways = middle - origins
    ahead = (ways * directions).sum(axis=1)
    beside = (ways * ways).sum(axis=1) - ahead**2
    met: Numbers = ((ahead >= -radius) & (ahead - radius <= ends) & (beside <= radius * radius)).nonzero()[0]
    return met


def middle_of(vertices: Array) -> Array:
    """The middle of the box around vertices (n, 3)."""
    if not len(vertices):
        return np.zeros(3)
    middle: Array = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return middle
