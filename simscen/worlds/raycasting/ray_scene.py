"""Ray casting with Embree: scenes for what never moves, for what lies at home, and for each thing that moves."""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from simscen.core.geometry import Array, Pose3, forward_and_left
from simscen.core.geometry.ray_fans import RayCaster, RayFan, Singles
from simscen.core.geometry.shapes import TriangleMesh
from simscen.worlds.raycasting.mesh_scene import Heights, MeshScene, MovingMesh, meeting, part_of
from simscen.worlds.raycasting.resting_bodies import Placed, RestingBodies

NOWHERE: Mapping[str, Pose3] = MappingProxyType({})

_FARTHEST = 1e30
"""m that a ray reaches at most, in single precision."""
_BEYOND = 1.001
"""Times its reach, where a ray ends that meets nothing within it."""

_ROOM, _HAIR = 0.1, 0.01
"""m beyond the heights of rays from which triangles are taken, at least; and what single precision may err by."""


class RayScene(RayCaster):
    """A `core.geometry.ray_fans.RayCaster` over the triangles of a world and of the bodies that move in it.

    A body that moves stays as it was built; the few rays that come near it are carried into its frame. Of what lies at
    home the triangles are carried into the frame of the world instead, once, so that many are asked at once: that is
    told by where it is now, not by what was asked before, and in which frame decides about last bits. Distances agree
    with PyBullet's rays within 1 mm. Embree works in single precision, so everything is kept about its own center: a
    world that lies 10 km from the origin loses nothing, one that is itself 10 km wide half a millimeter. What is
    built of a mesh is kept with that, for other scenes and for what is forked.
    """

    def __init__(self, static: "TriangleMesh | RayScene") -> None:
        """Of a world; or of that of another scene."""
        self._static: MeshScene = static._static if isinstance(static, RayScene) else part_of(static)
        self._movers: dict[str, MovingMesh] = {}
        self._piles = RestingBodies(self._static.middle)
        self._heights = math.inf, -math.inf

    def set_moving(self, bodies: Mapping[str, Placed], homes: Mapping[str, Pose3] = NOWHERE) -> None:
        """Say where the bodies are now: by name, the triangles in a body's frame and the pose of that frame.

        What is at its home, where it mostly stays, is kept in the frame of the world, with all else that is.
        """
        before, self._movers = self._movers, {}
        at_home = dict[str, Placed]()
        for name, (mesh, pose) in bodies.items():
            if homes and homes.get(name) == pose:
                at_home[name] = mesh, pose
                continue
            mover = before.get(name)
            if mover is None or mover.mesh is not mesh:
                mover = MovingMesh(mesh, part_of(mesh), pose)
            elif mover.pose != pose:
                mover = MovingMesh(mesh, mover.part, pose)
            self._movers[name] = mover
        if at_home or self._piles:
            self._piles.keep(at_home)

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """See core.geometry.ray_fans.RayCaster."""
        limit = min(reach, _FARTHEST)
        if not len(origins):
            return np.empty(0)
        distances = self._from_each(origins, directions, reach, limit * _BEYOND)
        answer = distances.astype(np.float64)
        answer[distances > limit] = np.inf
        return answer

    def sweep(self, fan: RayFan, pose: Pose3, reach: float) -> Singles:
        """See core.geometry.ray_fans.RayCaster. Runs once per scan, so that each numpy call (1 µs) counts."""
        place, (ahead, left) = pose[:3], forward_and_left(pose[3:])
        fan.turn(ahead, left)
        fan.end(min(reach, _FARTHEST) * _BEYOND)
        self._static.sweep(fan, place)
        if self._piles:
            rise = _rising(math.hypot(ahead[2], left[2]), reach)
            self._piles.sweep(fan, pose, reach, self._between(place[2] - rise, place[2] + rise))
        for mover in self._movers.values():
            if mover.away(place) <= reach:
                mover.sweep(fan, pose, (ahead, left))
        return fan.rays.distances()

    def _from_each(self, origins: Array, directions: Array, reach: float, end: float) -> Singles:
        """Where rays meet anything that begin in places of their own."""
        x, y, z = origins[0].tolist()
        reach += float(np.linalg.norm(origins - (x, y, z), axis=1).max())
        ends = self._static.distances(origins, directions, end)
        if self._piles:
            low, high = origins[:, 2].min(), origins[:, 2].max()
            down, up = directions[:, 2].min(), directions[:, 2].max()
            heights = self._between(low - _rising(-down, reach), high + _rising(up, reach))
            self._piles.cast(origins, directions, heights, ends)
        for mover in self._movers.values():
            if mover.away((x, y, z)) <= reach:
                rays = meeting(mover.middle, mover.part.radius, origins, directions, ends)
                if len(rays):
                    ends[rays] = mover.distances(origins[rays], directions[rays], ends[rays])
        return ends

    def _between(self, low: float, high: float) -> Heights:
        """Heights between which triangles are taken, for rays between these: mostly those of the call before."""
        below, above = self._heights
        if not (below <= low - _HAIR and high + _HAIR <= above):
            low, high = min(low, below), max(high, above)
            room = max(_ROOM, high - low)  # what tilts ever more has them taken anew a few times only
            self._heights = low - room, high + room
        return self._heights


def _rising(slope: float, reach: float) -> float:
    """How far a ray of a slope, of length 1 and sideways if negative, may rise."""
    return slope * reach if slope > 0 else 0.0


def ready(mesh: TriangleMesh) -> None:
    """Work out now what scenes of a world need to know of it: a fifth of a microsecond for each triangle."""
    part_of(mesh)
