"""Direct calls of the Embree library: scenes of triangles, and rays in packets of 16.

The embreex package, which contains the library, copies triangles number by number and casts rays one by one.
"""

import ctypes
from ctypes import c_int, c_size_t, c_uint, c_void_p
from functools import cache
from weakref import finalize

import numpy as np
from embreex import rtcore_scene

from simscen.core.geometry import Array
from simscen.core.geometry.ray_fans import PACKET_SIZE, RayPackets
from simscen.core.geometry.shapes import Mesh, TriangleMesh

_LIBRARY = ctypes.PyDLL(rtcore_scene.__file__)  # also finds the functions of the libraries it is linked with
_TRIANGLES, _ROBUST, _COHERENT, _ALL = 0, 1 << 2, 1 << 16, 0xFFFFFFFF
_INDICES, _VERTICES, _THREE_WORDS, _THREE_FLOATS = 0, 1, 0x5003, 0x9003
_NO_ERROR, _OUT_OF_MEMORY = 0, 4
_ALIGNED = 64

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
_ALL_VALID = np.full(PACKET_SIZE + _ALIGNED // 4, -1, dtype=np.int32)
_ALL_VALID_ADDRESS = c_void_p(_ALL_VALID.ctypes.data + -_ALL_VALID.ctypes.data % _ALIGNED)
"""Address of the mask of a packet in which all rays are valid."""


@cache
def _device() -> c_void_p:
    """Return a device with one thread, because other threads would not exist after a fork."""
    return c_void_p(_LIBRARY.rtcNewDevice(b"threads=1"))


class EmbreeScene:
    """Triangles that rays can hit."""

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
            share, corners, faces = _LIBRARY.rtcSetSharedGeometryBuffer, self._vertices, self._faces
            share(geometry, _VERTICES, 0, _THREE_FLOATS, corners.ctypes.data, 0, corners.strides[0], len(vertices))
            share(geometry, _INDICES, 0, _THREE_WORDS, faces.ctypes.data, 0, faces.strides[0], count)
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
