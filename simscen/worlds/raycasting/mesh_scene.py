"""Cast rays against one mesh, static or moving, by direct calls of the Embree library in packets of 16 rays.

The embreex package contains the library, but its own Python functions are slow.

A fan contains the rays of a planar lidar (see `RayFan`). To sweep a fan means to cast its rays: each ray is shortened
to end at the first triangle that it hits. Several scenes can shorten the rays of one fan, one after another.
"""

import ctypes
import math
from ctypes import c_int, c_size_t, c_uint, c_void_p
from functools import cache, cached_property
from weakref import finalize

import numpy as np
import numpy.typing as npt
from embreex import rtcore_scene

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array, Pose3, Vector, rotate_vector
from simscen.core.geometry.ray_fans import ALL_PACKETS, PACKET_SIZE, Float32Array, RayFan, RayPackets
from simscen.core.geometry.shapes import Mesh, TriangleMesh

_LIBRARY = ctypes.PyDLL(rtcore_scene.__file__)  # also finds the functions of the libraries that it is linked with

# Values of Embree's enumerations and bit masks.
_TRIANGLES, _ROBUST, _COHERENT, _ALL = 0, 1 << 2, 1 << 16, 0xFFFFFFFF
"""RTC_GEOMETRY_TYPE_TRIANGLE, RTC_SCENE_FLAG_ROBUST, RTC_RAY_QUERY_FLAG_COHERENT, RTC_FEATURE_FLAG_ALL."""
_INDICES, _VERTICES, _THREE_WORDS, _THREE_FLOATS = 0, 1, 0x5003, 0x9003
"""RTC_BUFFER_TYPE_INDEX, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_UINT3, RTC_FORMAT_FLOAT3."""
_NO_ERROR, _OUT_OF_MEMORY = 0, 4
"""RTC_ERROR_NONE, RTC_ERROR_OUT_OF_MEMORY."""
_ALIGNMENT_BYTES = 64
"""Required alignment of the mask of valid rays of a packet."""

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
    """Embree's `RTCIntersectArguments`: options of a ray query."""

    _fields_ = (("flags", c_int), ("features", c_uint), ("callbacks", c_void_p * 3))


_QUERY = _Query(_COHERENT, _ALL)
_QUERY_ADDRESS = c_void_p(ctypes.addressof(_QUERY))
_ALL_VALID = np.full(PACKET_SIZE + _ALIGNMENT_BYTES // 4, -1, dtype=np.int32)
_ALL_VALID_ADDRESS = c_void_p(_ALL_VALID.ctypes.data + -_ALL_VALID.ctypes.data % _ALIGNMENT_BYTES)
"""Address, aligned within _ALL_VALID, of the mask of a packet in which all rays are valid."""


@cache
def _device() -> c_void_p:
    """Return the Embree device. It has one thread, because other threads would not exist after a fork."""
    return c_void_p(_LIBRARY.rtcNewDevice(b"threads=1"))


class EmbreeScene:
    """Thin wrapper of an `RTCScene` of triangles, in the frame of the vertices."""

    def __init__(self, vertices: Array, mesh: TriangleMesh | Mesh) -> None:
        """Build the scene from the faces of `mesh`, with `vertices` (n, 3) instead of the mesh's own vertices.

        Raises MemoryError, or RuntimeError if Embree refuses the triangles.
        """
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

    def shorten(self, rays: RayPackets, packets: slice = ALL_PACKETS) -> None:
        """Shorten the rays in a range of packets to the first triangle that they hit."""
        intersect, scene = _LIBRARY.rtcIntersect16, self._scene
        for packet in rays.addresses[packets]:
            intersect(_ALL_VALID_ADDRESS, scene, packet, _QUERY_ADDRESS)


class MeshScene:
    """Triangles of a mesh to cast rays at, in the frame of the mesh.

    Embree works in single precision and therefore receives all positions relative to `center`.

    center:  point near the mesh in m, by default the center of its bounding box
    radius:  radius in m of a sphere around `center` that contains the mesh
    extent:  radius in m of a sphere around the origin of the frame that contains the mesh
    """

    def __init__(self, mesh: TriangleMesh | Mesh, center: Vector | None = None) -> None:
        self.center = _bounding_box_center(mesh.vertices) if center is None else center
        corners = mesh.vertices - self.center
        # Slightly more, for rays that touch the farthest corner.
        self.radius = 1.001 * float(np.linalg.norm(corners, axis=1).max(initial=0.0))
        self.extent = math.hypot(*self.center) + self.radius
        self._scene = EmbreeScene(corners, mesh)

    def distances(self, origins: Array, directions: Array, lengths: float | Float32Array) -> Float32Array:
        """Return the distances (n,) in m to the first hits of single rays; `lengths` for rays without a hit.

        The rays start at `origins` (n, 3), have the unit vectors `directions` (n, 3), and are `lengths` (n,) m long.
        """
        rays = RayPackets(len(origins))
        rays.set_rays(origins - self.center, directions, lengths)
        self._scene.shorten(rays)
        return rays.distances()

    def sweep(self, fan: RayFan, position: Vector, packets: slice = ALL_PACKETS) -> None:
        """Shorten the rays of a fan at `position` in a range of packets.

        The directions of the fan must be set before, in the frame of the mesh.
        """
        (x, y, z), (mx, my, mz) = position, self.center
        fan.set_origin(x - mx, y - my, z - mz, packets)
        self._scene.shorten(fan.rays, packets)


@cached_on_instance
def cached_mesh_scene(mesh: TriangleMesh) -> MeshScene:
    """Return the scene of a mesh, which is built once and kept with the mesh. Forked processes share it."""
    return MeshScene(mesh)


class MovingMesh:
    """A mesh at a pose in the world. Rays are transformed to the frame of the mesh, whose scene never changes."""

    def __init__(self, mesh: TriangleMesh, scene: MeshScene, pose: Pose3) -> None:
        """Place a mesh with its `scene` at a `pose` in the world."""
        self.mesh, self.scene, self.pose = mesh, scene, pose

    @cached_property
    def center(self) -> Vector:
        """Center of the scene in the world frame."""
        x, y, z, i, j, k, w = self.pose
        p, q, r = rotate_vector((i, j, k, w), self.scene.center)
        return x + p, y + q, z + r

    @cached_property
    def _world_rotation(self) -> Array:
        """Rotation matrix (3, 3) from the frame of the mesh to the world frame."""
        return self.pose.rotation()

    def min_distance(self, position: Vector) -> float:
        """Return a lower bound of the distance in m between the mesh and a position in the world frame."""
        return math.dist(self.pose[:3], position) - self.scene.extent

    def distances(self, origins: Array, directions: Array, lengths: Float32Array) -> Float32Array:
        """Return the distances as `MeshScene.distances` does, but for rays in the world frame."""
        rotation = self._world_rotation
        return self.scene.distances((origins - self.pose[:3]) @ rotation, directions @ rotation, lengths)

    def sweep(self, fan: RayFan, pose: Pose3, axes: tuple[Vector, Vector]) -> None:
        """Shorten the rays of a fan at `pose` in the world, in the packets that may hit the mesh.

        `axes` are the unit vectors of the x-axis and the y-axis of `pose`, in the world frame.
        """
        (px, py, pz, *_), (ahead, left), (x, y, z, i, j, k, w) = pose, axes, self.pose
        inverse = -i, -j, -k, w
        for packets in packets_towards_sphere(fan, pose, self.center, self.scene.radius):
            fan.set_directions(rotate_vector(inverse, ahead), rotate_vector(inverse, left), packets)
            self.scene.sweep(fan, rotate_vector(inverse, (px - x, py - y, pz - z)), packets)


def packets_towards_sphere(fan: RayFan, pose: Pose3, center: Vector, radius: float) -> list[slice]:
    """Return the ranges of packets of a fan at `pose` in which a ray may hit a sphere."""
    (x, y, z), (px, py, pz, i, j, k, w) = center, pose
    offset = x - px, y - py, z - pz
    distance = math.hypot(*offset)
    ahead, left, _ = rotate_vector((-i, -j, -k, w), offset)
    tangent_length = math.sqrt(distance * distance - radius * radius) if distance > radius else -math.inf
    cone = fan.rays_towards(ahead, left, tangent_length)
    lengths = fan.rays.lengths
    found = [slice(rays.start // PACKET_SIZE, -(-rays.stop // PACKET_SIZE)) for rays in cone]
    # `max` would take ten times as long as `item(argmax())`.
    return [packets for packets in found if (part := lengths[packets]).item(part.argmax()) >= distance - radius]


def rays_hitting_sphere(
    center: Vector, radius: float, origins: Array, directions: Array, lengths: Float32Array
) -> npt.NDArray[np.int64]:
    """Return the indices of single rays that may hit a sphere. Rays are given as in `MeshScene.distances`."""
    offsets = center - origins
    ahead = (offsets * directions).sum(axis=1)
    lateral_squared = (offsets * offsets).sum(axis=1) - ahead**2
    hit: npt.NDArray[np.int64] = (
        (ahead >= -radius) & (ahead - radius <= lengths) & (lateral_squared <= radius * radius)
    ).nonzero()[0]
    return hit


def _bounding_box_center(vertices: Array) -> Vector:
    """Return the center of the bounding box of vertices (n, 3); zeros without vertices."""
    if not len(vertices):
        return 0.0, 0.0, 0.0
    x, y, z = ((vertices.min(axis=0) + vertices.max(axis=0)) / 2).tolist()
    return x, y, z
