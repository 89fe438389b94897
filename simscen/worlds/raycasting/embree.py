"""Embree by its own interface: scenes of triangles, and sixteen rays at a time.

The package that brings it copies triangles number by number, and asks for one ray after the other.
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

_LIBRARY = ctypes.PyDLL(rtcore_scene.__file__)  # whose names are also those of the libraries that it needs
_TRIANGLES, _ROBUST, _COHERENT, _ALL = 0, 1 << 2, 1 << 16, 0xFFFFFFFF
_INDICES, _VERTICES, _THREE_WORDS, _THREE_FLOATS = 0, 1, 0x5003, 0x9003
_FINE, _OUT_OF_MEMORY = 0, 4
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
    ("rtcIntersect16", None, None),  # which is called most: it takes what is of the right kind as it is
):
    getattr(_LIBRARY, _name).restype = _result
    getattr(_LIBRARY, _name).argtypes = _arguments


class _Query(ctypes.Structure):
    """Embree's `RTCIntersectArguments`."""

    _fields_ = (("flags", c_int), ("features", c_uint), ("callbacks", c_void_p * 3))


_QUERY = _Query(_COHERENT, _ALL)
_HOW = c_void_p(ctypes.addressof(_QUERY))
_NUMBERS = np.full(PACKET_SIZE + _ALIGNED // 4, -1, dtype=np.int32)
_EACH = c_void_p(_NUMBERS.ctypes.data + -_NUMBERS.ctypes.data % _ALIGNED)
"""That each ray of a packet is meant."""


@cache
def _device() -> c_void_p:
    """Embree in one thread: others would not survive a fork, where scenes are to."""
    return c_void_p(_LIBRARY.rtcNewDevice(b"threads=1"))


class Scene:
    """Triangles for rays to meet."""

    def __init__(self, vertices: Array, mesh: TriangleMesh | Mesh) -> None:
        """The faces of a mesh, whose vertices (n, 3) are given anew."""
        device, count = _device(), len(mesh.faces)
        self._scene = c_void_p(_LIBRARY.rtcNewScene(device))
        finalize(self, _LIBRARY.rtcReleaseScene, self._scene).atexit = False
        # Robust: without it rays may slip through the edge between two triangles.
        _LIBRARY.rtcSetSceneFlags(self._scene, _ROBUST)
        # Embree reads them where they are, and a word beyond the last vertex.
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
        if error != _FINE:
            raise RuntimeError(f"Embree cannot take {count} triangles (its error {error})")

    def cut(self, rays: RayPackets, some: slice = slice(None)) -> None:
        """Rays end where they meet something; of `some` packets alone."""
        intersect, scene = _LIBRARY.rtcIntersect16, self._scene
        for packet in rays.addresses[some]:
            intersect(_EACH, scene, packet, _HOW)
