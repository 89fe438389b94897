"""Embree scenes of meshes, and the direct calls of the Embree library that cast rays in packets of 16.

The embreex package, which contains the library, copies triangles number by number and casts rays one by one.
"""

import ctypes
import math
from ctypes import c_int, c_size_t, c_uint, c_void_p
from functools import cache
from weakref import finalize

import numpy as np
import numpy.typing as npt
from embreex import rtcore_scene

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array, Pose3, Vector, rotated
from simscen.core.geometry.ray_fans import ALL_PACKETS, PACKET_SIZE, RayFan, RayPackets, Singles
from simscen.core.geometry.shapes import Mesh, TriangleMesh

_LIBRARY = ctypes.PyDLL(rtcore_scene.__file__)  # also finds the functions of the libraries it is linked with
_TRIANGLES, _ROBUST, _COHERENT, _ALL = 0, 1 << 2, 1 << 16, 0xFFFFFFFF
_INDICES, _VERTICES, _THREE_WORDS, _THREE_FLOATS = 0, 1, 0x5003, 0x9003
_NO_ERROR, _OUT_OF_MEMORY = 0, 4
_ALIGNMENT_BYTES = 64

for _name, _result, _arguments in (
    ("rtcNewDevice", c_void_p, (ctypes.c_char_p,)),
    ("rtcGetDeviceError", c_int, (c_void_p,)),
    ("rtcNewScene", c_void_p, (c_void_p,)),
    ("rtcSetSceneFlags", None, (c_void_p, c_int)),
    ("rtcCommitScene", None, (c_void_p,)),
    ("rtcReleaseScene", None, (c_void_p,)),
    ("rtcNewGeometry", c_void_p, (c_void_p, c_int)),
    (
        "rtcSetSharedGeometryBuffer",
        None,
        (c_void_p, c_int, c_uint, c_int, c_void_p, c_size_t, c_size_t, c_size_t),
    ),
    ("rtcCommitGeometry", None, (c_void_p,)),
    ("rtcAttachGeometry", c_uint, (c_void_p, c_void_p)),
    ("rtcReleaseGeometry", None, (c_void_p,)),
    ("rtcIntersect16", None, None),  # called most often: without argument types, arguments are not converted
):
    getattr(_LIBRARY, _name).restype = _result
    getattr(_LIBRARY, _name).argtypes = _arguments


class _Query(ctypes.Structure):
    """Embree's `RTCIntersectArguments`."""

    _fields_ = (("flags", c_int), ("features", c_uint), ("callbacks", c_void_p * 3))


_QUERY = _Query(_COHERENT, _ALL)
_QUERY_ADDRESS = c_void_p(ctypes.addressof(_QUERY))
_ALL_VALID = np.full(PACKET_SIZE + _ALIGNMENT_BYTES // 4, -1, dtype=np.int32)
_ALL_VALID_ADDRESS = c_void_p(_ALL_VALID.ctypes.data + -_ALL_VALID.ctypes.data % _ALIGNMENT_BYTES)
"""Address of the mask of a packet in which all rays are valid."""


@cache
def _device() -> c_void_p:
    """Return a device with one thread, because other threads would not exist after a fork."""
    return c_void_p(_LIBRARY.rtcNewDevice(b"threads=1"))


class EmbreeScene:
    """Embree scene of triangles."""

    def __init__(self, vertices: Array, mesh: TriangleMesh | Mesh) -> None:
        """Build a scene of the faces of a mesh with other vertices (n, 3)."""
        device, count = _device(), len(mesh.faces)
        self._scene = c_void_p(_LIBRARY.rtcNewScene(device))
        finalize(self, _LIBRARY.rtcReleaseScene, self._scene).atexit = False
        # Without this flag, rays can pass through the edge between two triangles.
        _LIBRARY.rtcSetSceneFlags(self._scene, _ROBUST)
        # Embree reads the arrays in place, and four bytes beyond the last vertex.
        self._vertices = np.zeros((len(vertices) + 1, 3), dtype=np.float32)
        self._vertices[:-1] = vertices
        self._faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
        if count:
            geometry = c_void_p(_LIBRARY.rtcNewGeometry(device, _TRIANGLES))
            set_buffer, corners, faces = _LIBRARY.rtcSetSharedGeometryBuffer, self._vertices, self._faces
            set_buffer(geometry, _VERTICES, 0, _THREE_FLOATS, corners.ctypes.data, 0, corners.strides[0], len(vertices))
            set_buffer(geometry, _INDICES, 0, _THREE_WORDS, faces.ctypes.data, 0, faces.strides[0], count)
            _LIBRARY.rtcCommitGeometry(geometry)
            _LIBRARY.rtcAttachGeometry(self._scene, geometry)
            _LIBRARY.rtcReleaseGeometry(geometry)
        _LIBRARY.rtcCommitScene(self._scene)
        error = _LIBRARY.rtcGetDeviceError(device)
        if error == _OUT_OF_MEMORY:
            raise MemoryError
        if error != _NO_ERROR:
            raise RuntimeError(f"Embree cannot take {count} triangles (error {error})")

    def shorten(self, rays: RayPackets, packets: slice = slice(None)) -> None:
        """End the rays of some `packets` at the first triangle that they hit."""
        intersect, scene = _LIBRARY.rtcIntersect16, self._scene
        for packet in rays.addresses[packets]:
            intersect(_ALL_VALID_ADDRESS, scene, packet, _QUERY_ADDRESS)


HeightRange = tuple[float, float]
"""Minimum and maximum height of rays in m."""
Numbers = npt.NDArray[np.int64]


class MeshScene:
    """Embree scene of a mesh, relative to its center, because Embree works in single precision.

    `radius` is the radius of the bounding sphere, `extent` the greatest distance of the mesh from the origin of its
    frame.
    """

    def __init__(self, mesh: TriangleMesh | Mesh, middle: Array | None = None) -> None:
        """Build the scene relative to `middle` (3,); default: the center of the mesh."""
        self.middle = bounding_box_center(mesh.vertices) if middle is None else middle
        x, y, z = self.middle.tolist()
        self.center = (x, y, z)
        corners = mesh.vertices - self.middle
        # Slightly more, for rays that touch the farthest corner.
        self.radius = 1.001 * float(np.linalg.norm(corners, axis=1).max(initial=0.0))
        self.extent = math.hypot(x, y, z) + self.radius
        self._scene = EmbreeScene(corners, mesh)

    def distances(self, origins: Array, directions: Array, ends: float | Singles) -> Singles:
        """Return the distances (n,) to the first hits of rays in the frame of the mesh, or to their ends."""
        rays = RayPackets(len(origins))
        rays.put(origins - self.middle, directions, ends)
        self._scene.shorten(rays)
        return rays.distances()

    def sweep(self, fan: RayFan, position: Vector, packets: slice = ALL_PACKETS) -> None:
        """Shorten some `packets` of a fan's rays, which start at `position` with their current directions."""
        (x, y, z), (mx, my, mz) = position, self.center
        fan.set_origin(x - mx, y - my, z - mz, packets)
        self._scene.shorten(fan.rays, packets)


@cached_on_instance
def cached_mesh_scene(mesh: TriangleMesh) -> MeshScene:
    """Return the scene of a mesh, cached with the mesh, also for forked processes."""
    return MeshScene(mesh)


class MovingMesh:
    """Mesh scene at a pose in the world. Its center and rotation are computed when rays come near."""

    def __init__(self, mesh: TriangleMesh, part: MeshScene, pose: Pose3) -> None:
        """Place the scene `part` of a mesh at a pose of its frame in the world."""
        self.mesh, self.part, self.pose = mesh, part, pose
        self._middle: Vector | None = None
        self._rotation: Array | None = None

    @property
    def middle(self) -> Vector:
        """The center in the world."""
        if self._middle is None:
            x, y, z, i, j, k, w = self.pose
            p, q, r = rotated((i, j, k, w), self.part.center)
            self._middle = x + p, y + q, z + r
        return self._middle

    @property
    def _world_rotation(self) -> Array:
        if self._rotation is None:
            self._rotation = self.pose.rotation()
        return self._rotation

    def min_distance(self, position: Vector) -> float:
        """Return a lower bound of the distance in m from a position in the world."""
        return math.dist(self.pose[:3], position) - self.part.extent

    def distances(self, origins: Array, directions: Array, ends: Singles) -> Singles:
        """Return the distances (n,) to the first hits of rays in the world frame, as `MeshScene.distances`."""
        rotation = self._world_rotation
        return self.part.distances((origins - self.pose[:3]) @ rotation, directions @ rotation, ends)

    def sweep(self, fan: RayFan, pose: Pose3, axes: tuple[Vector, Vector]) -> None:
        """Shorten the rays of a fan at `pose`, whose x and y axes are `axes`.

        Only rays within the cone around the bounding sphere are cast, if any of them is long enough.
        """
        for packets in packets_towards_sphere(fan, pose, self.middle, self.part.radius):
            self._sweep_packets(fan, packets, pose, axes)

    def _sweep_packets(self, fan: RayFan, packets: slice, pose: Pose3, axes: tuple[Vector, Vector]) -> None:
        (px, py, pz, *_), (ahead, left), (x, y, z, i, j, k, w) = pose, axes, self.pose
        inverse = -i, -j, -k, w
        fan.set_directions(rotated(inverse, ahead), rotated(inverse, left), packets)
        self.part.sweep(fan, rotated(inverse, (px - x, py - y, pz - z)), packets)


def packets_towards_sphere(fan: RayFan, pose: Pose3, middle: Vector, radius: float) -> list[slice]:
    """Return the packets of a fan at `pose` with rays that may hit a sphere."""
    (x, y, z), (px, py, pz, i, j, k, w) = middle, pose
    offset = x - px, y - py, z - pz
    distance = math.hypot(*offset)
    ahead, left, _ = rotated((-i, -j, -k, w), offset)
    cone = fan.rays_towards(
        ahead, left, math.sqrt(distance * distance - radius * radius) if distance > radius else -math.inf
    )
    ends = fan.rays.ends
    found = [slice(rays.start // PACKET_SIZE, -(-rays.stop // PACKET_SIZE)) for rays in cone]
    # `max` would take ten times as long as `item(argmax())`.
    return [packets for packets in found if (some := ends[packets]).item(some.argmax()) >= distance - radius]


def rays_hitting_sphere(middle: Vector, radius: float, origins: Array, directions: Array, ends: Singles) -> Numbers:
    """Return the indices of rays with different origins that hit a sphere before they end."""
    offsets = middle - origins
    ahead = (offsets * directions).sum(axis=1)
    lateral_squared = (offsets * offsets).sum(axis=1) - ahead**2
    hit: Numbers = ((ahead >= -radius) & (ahead - radius <= ends) & (lateral_squared <= radius * radius)).nonzero()[0]
    return hit


def bounding_box_center(vertices: Array) -> Array:
    """Return the center (3,) of the bounding box of vertices (n, 3)."""
    if not len(vertices):
        return np.zeros(3)
    middle: Array = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return middle
