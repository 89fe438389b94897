"""Ray casting with Embree: one scene for what never moves, a small one for what does."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh as EmbreeMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

from simscen.core.geometry import Array, Pose3
from simscen.core.shapes import TriangleMesh

Singles = npt.NDArray[np.float32]
Indices = npt.NDArray[np.int32]
Placed = tuple[TriangleMesh, Pose3]

_NO_HIT = np.float32(1e30)
"""Embree answers 1e37 for a ray that meets nothing."""


@dataclass(frozen=True, eq=False)
class Hits:
    """What rays met: `distances` (n,) in metres, inf for nothing; `owners` (n,) into `names`, -1 for nothing."""

    distances: Array
    owners: Indices
    names: tuple[str, ...]


class RayScene:
    """A `core.rays.RayCaster` over the triangles of a world and of the bodies that move in it.

    Distances agree with PyBullet's rays within 1 mm. Embree works in single precision, so everything is kept
    about the centre of the world: one that lies 10 km from the origin loses nothing, one that is itself 10 km
    wide half a millimetre. Make a scene in the process that uses it: Embree's threads do not survive a fork.
    """

    def __init__(self, static: TriangleMesh) -> None:
        self._device = EmbreeDevice()
        self._centre = _middle(static.vertices)
        self._names = static.names
        self._static = _Part(self._device, static.vertices - self._centre, static.faces, static.owners)
        self._moving = self._part({})
        self._placed: Mapping[str, Placed] = {}

    def set_moving(self, bodies: Mapping[str, Placed]) -> None:
        """Say where the bodies are now: by name, the triangles in a body's frame and the pose of that frame."""
        if not _same(bodies, self._placed):
            self._placed = dict(sorted(bodies.items()))
            self._moving = self._part(self._placed)

    def cast(self, origins: Array, directions: Array) -> Array:
        """Distances (n,) in metres along unit `directions` (n, 3) from `origins` (n, 3); inf for no hit."""
        starts, along = self._singles(origins, directions)
        distances = self._static.distances(starts, along)
        if self._placed:
            distances = np.minimum(distances, self._moving.distances(starts, along))
        return _metres(distances)

    def cast_owners(self, origins: Array, directions: Array) -> Hits:
        """Like `cast`, and whose surface each ray met: that of a static solid or of a moving body."""
        starts, along = self._singles(origins, directions)
        distances, owners = self._static.hits(starts, along)
        nearer, bodies = self._moving.hits(starts, along)
        owners = np.where(nearer < distances, bodies + np.int32(len(self._names)), owners)
        return Hits(_metres(np.minimum(distances, nearer)), owners, (*self._names, *self._placed))

    def _part(self, placed: Mapping[str, Placed]) -> "_Part":
        """A scene of moving bodies; each is the owner of its faces, in the order of `placed`."""
        vertices, faces, owners = [np.empty((0, 3))], [np.empty((0, 3), np.int32)], [np.empty(0, np.int32)]
        count = 0
        for owner, (mesh, pose) in enumerate(placed.values()):
            vertices.append(pose.apply(mesh.vertices) - self._centre)
            faces.append(mesh.faces + np.int32(count))
            owners.append(np.full(len(mesh.faces), owner, dtype=np.int32))
            count += len(mesh.vertices)
        return _Part(self._device, np.concatenate(vertices), np.concatenate(faces), np.concatenate(owners))

    def _singles(self, origins: Array, directions: Array) -> tuple[Singles, Singles]:
        starts = np.subtract(origins, self._centre).astype(np.float32)
        return starts, np.ascontiguousarray(directions, dtype=np.float32)


class _Part:
    """One Embree scene and the owners of its faces."""

    def __init__(self, device: EmbreeDevice, vertices: Array, faces: Indices, owners: Indices) -> None:
        # Robust: without it rays may slip through the edge between two triangles.
        self._scene = EmbreeScene(device, True)
        self._owners = owners
        if len(faces):
            corners = np.ascontiguousarray(vertices, dtype=np.float32)
            EmbreeMesh(self._scene, corners, np.ascontiguousarray(faces, dtype=np.int32))

    def distances(self, starts: Singles, along: Singles) -> Singles:
        """Distances (n,), beyond _NO_HIT where nothing is hit."""
        answer: Singles = self._scene.run(starts, along, query="DISTANCE")
        return answer

    def hits(self, starts: Singles, along: Singles) -> tuple[Singles, Indices]:
        """Distances (n,) and owners (n,), -1 where nothing is hit."""
        answer = self._scene.run(starts, along, output=True)
        faces = answer["primID"]
        owners = np.full(len(faces), -1, dtype=np.int32)
        owners[faces >= 0] = self._owners[faces[faces >= 0]]
        return answer["tfar"], owners


def _metres(distances: Singles) -> Array:
    return np.where(distances < _NO_HIT, distances, np.inf).astype(np.float64)


def _middle(vertices: Array) -> Array:
    if not len(vertices):
        return np.zeros(3)
    middle: Array = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return middle


def _same(bodies: Mapping[str, Placed], others: Mapping[str, Placed]) -> bool:
    if bodies.keys() != others.keys():
        return False
    return all(mesh is others[name][0] and pose == others[name][1] for name, (mesh, pose) in bodies.items())
