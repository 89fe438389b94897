"""How near the robot is to what never moves, solid by solid.

Asking the fused mesh would be exact too, but costs 0.6 µs for each triangle within reach: 20 to 40 ms of CPU for each
simulated second in a BARN world (28 facets a cylinder, 40 Hz). Here every solid that is convex is one convex shape, in
an engine of its own that is never stepped, built when the robot first comes near. A concave solid as large as a map
(188 000 triangles in one) is taken in tiles, each built and asked only when the robot is near it.
"""

import itertools
import math
from collections.abc import Collection

import numpy as np
import numpy.typing as npt
import pybullet

from simscen.core.facemesh import compact, is_convex
from simscen.core.geometry import Array, Pose3
from simscen.core.shapes import TriangleMesh
from simscen.core.terrain import FLOOR
from simscen.sim import engine, outline
from simscen.sim.clients import CLIENTS
from simscen.sim.enclosure import TILT, winds_along_a_line, winds_around
from simscen.sim.parts import parts_of
from simscen.sim.robot_body import RobotBody

STRIDE, FAR_STRIDE = 0.5, 4.0
"""m that the robot may move before the list of solids around it is made anew, and that of those it is made of."""
SLACK = 0.15
"""m beyond the nearest within which others are measured too, so that they need not be asked again at once."""
NO_PLACE, NO_TURN = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
NOISE = 0.005
"""m farther than the nearest may have gone within which it is measured; what lies farther costs time."""


class Proximity:
    """The solids of a static world, as seen from one robot. `reach` is how far it looks, in metres."""

    def __init__(self, static: TriangleMesh, robot: RobotBody, reach: float) -> None:
        self._client = CLIENTS.take()
        self._mesh, self._reach = static, reach
        self._radius, height = outline.reach(robot.solid)
        self._extent = math.hypot(self._radius, height)
        self._hull = engine.hull_shapes(self._client, robot.solid)
        self._parts = parts_of(static)
        self._pairs: dict[int, list[tuple[int, int]]] = {}
        # For each part around: a lower bound of its distance plus what had been travelled when that was known.
        self._bounds: dict[int, float] = {}
        self._travelled = 0.0
        # The least of them, but for the nearest part's: as long as that is farther, no other has to be looked at.
        self._least = -math.inf
        self._nearest: int | None = None
        self._distance = math.inf
        self._pose, self._centre = Pose3(), (math.inf, math.inf)
        self._standing: npt.NDArray[np.int64] = np.flatnonzero(self._parts.high[:, 2] > FLOOR)
        self._about, self._far_centre = self._standing, self._centre

    def distance(self, pose: Pose3) -> float:
        """Distance in metres from the robot, with its base at `pose`, to the nearest solid; inf beyond the reach.

        The distance to a part changes at most by what the robot moves, so only those are measured again that may have
        come nearer than the nearest, and the nearest no farther than it may have gone: what is asked costs time for
        each triangle within reach.
        """
        moved = motion(self._pose, pose, self._extent)
        self._travelled += moved
        self._pose = pose
        if math.dist(pose[:2], self._centre) > STRIDE:
            self._look_around(pose)
        nearest = math.inf
        if self._nearest is not None:
            nearest = self._measure(self._nearest, min(self._distance + moved + NOISE, self._reach))
            if nearest == math.inf:
                self._nearest, self._least = None, -math.inf
        if self._least - self._travelled < min(nearest, self._reach):
            nearest = self._look_for_nearer(nearest)
        self._distance = nearest
        return nearest

    def _look_for_nearer(self, nearest: float) -> float:
        """Measures the other parts that may be nearer."""
        limit = min(nearest, self._reach)
        for part, bound in self._bounds.items():
            if bound - self._travelled < limit and part != self._nearest:
                found = self._measure(part, min(nearest + SLACK, self._reach))
                if found < nearest:
                    nearest, self._nearest = found, part
                    limit = min(nearest, self._reach)
        others = [bound for part, bound in self._bounds.items() if part != self._nearest]
        self._least = min(others, default=math.inf)
        return nearest

    def _measure(self, part: int, within: float) -> float:
        """Distance to one part; inf if above `within`. Remembers what is known for later."""
        pairs = self._pairs.get(part)
        if pairs is None:
            pairs = self._pairs[part] = list(itertools.product(self._hull, self._build(part)))
        place, turn, client = self._pose[:3], self._pose[3:], self._client
        nearest = math.inf
        for hull, body in pairs:
            # In the order of PyBullet's manual: names would cost a fifth of the call. Body B has a place of its own.
            for point in pybullet.getClosestPoints(
                -1, body, within, -1, -1, hull, -1, place, NO_PLACE, turn, NO_TURN, client
            ):
                nearest = min(nearest, point[8])
        self._bounds[part] = min(nearest, within) + self._travelled
        return nearest

    def _look_around(self, pose: Pose3) -> None:
        """Lists the parts that may come within reach during the next stride."""
        self._centre = (pose.x, pose.y)
        if math.dist(self._centre, self._far_centre) > FAR_STRIDE:
            self._far_centre = self._centre
            self._about, _ = self._within(self._reach + STRIDE + FAR_STRIDE, self._standing)
        near, far = self._within(self._reach + STRIDE, self._about)
        known = self._bounds
        self._bounds = {
            part: max(bound + self._travelled, known.get(part, -math.inf))
            for bound, part in sorted(zip(far.tolist(), near.tolist(), strict=True))
        }
        self._least = -math.inf
        if self._nearest not in self._bounds:
            self._nearest = None

    def _within(self, metres: float, parts: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], Array]:
        """Those of some parts that may be within so many metres of the robot, and how far they are at least."""
        low, high = self._parts.low[parts, :2], self._parts.high[parts, :2]
        outside = np.maximum(np.maximum(low - self._centre, self._centre - high), 0.0)
        far = np.hypot(outside[:, 0], outside[:, 1]) - self._radius
        near = far < metres
        return parts[near], far[near]

    def _build(self, part: int) -> list[int]:
        vertices, faces = self._mesh.vertices, self._mesh.faces[self._parts.faces(part)]
        if self._parts.whole(part) and is_convex(solid := compact(vertices, faces)):
            shapes = [engine.convex_shape(self._client, solid.vertices)]
        else:
            lots = engine.tiles(vertices, engine.above_floor(vertices, faces))
            shapes = [engine.concave_shape(self._client, compact(vertices, lot)) for lot in lots]
        bodies = [engine.fixed(self._client, shape) for shape in shapes]
        for body in bodies:
            pybullet.changeDynamics(body, -1, collisionMargin=0.0, physicsClientId=self._client)
        return bodies

    def around(self, place: tuple[float, float, float], but: Collection[int] = ()) -> list[int]:
        """The solids that a place is inside of, by number, without those in `but`."""
        asked = [owner for owner in self._parts.holding(place) if owner not in but]
        return [owner for owner in asked if self._winds_around(owner, place)]

    def _winds_around(self, owner: int, place: tuple[float, float, float]) -> bool:
        """Of a solid of many tiles mostly those suffice that lie above and below the place: 0.2 ms for 100."""
        parts, vertices = self._parts, self._mesh.vertices
        tiles = parts.of(owner)
        if len(tiles) > 1:
            low, high = parts.low[tiles.start : tiles.stop], parts.high[tiles.start : tiles.stop]
            leans = max(TILT) * max(high[:, 2].max() - place[2], place[2] - low[:, 2].min())
            over = ((low[:, :2] - leans <= place[:2]) & (place[:2] <= high[:, :2] + leans)).all(axis=1)
            meeting = [parts.faces(tile) for tile, meets in zip(tiles, over.tolist(), strict=True) if meets]
            faces = np.concatenate([np.empty(0, np.int64), *meeting])
            said = winds_along_a_line(vertices[self._mesh.faces[faces]], place)
            if said is not None:
                return said
        return winds_around(vertices[self._faces(owner)], place)

    def convex(self, owner: int) -> bool:
        """Whether a solid is convex."""
        return is_convex(compact(self._mesh.vertices, self._faces(owner)))

    def _faces(self, owner: int) -> npt.NDArray[np.int32]:
        return self._mesh.faces[self._parts.faces_of(owner)]

    def name(self, owner: int) -> str:
        """What a solid is called."""
        return self._mesh.names[owner]

    def owner(self, place: tuple[float, float, float]) -> str:
        """The name of the solid whose surface is nearest to a place where the hull touches something."""
        point = np.array(place)
        outside = np.maximum(np.maximum(self._parts.low - point, point - self._parts.high), 0.0)
        near = np.flatnonzero((outside < 0.05).all(axis=1))
        if not len(near):
            return ""
        faces = np.concatenate([self._parts.faces(part) for part in near.tolist()])
        distances = point_to_triangles(point, self._mesh.vertices[self._mesh.faces[faces]])
        return self._mesh.names[int(self._mesh.owners[faces[int(np.argmin(distances))]])]

    def close(self) -> None:
        """Give the engine back."""
        CLIENTS.give_back(self._client)


def motion(before: Pose3, after: Pose3, extent: float) -> float:
    """A bound on how far any point within `extent` of the base's origin has moved, in metres.

    A turn by an angle a moves it by 2 sin(a / 2) times that, and quaternions by 2 sin(a / 4).
    """
    return math.dist(before[:3], after[:3]) + 2 * extent * math.dist(before[3:], after[3:])


def point_to_triangles(point: Array, corners: Array) -> Array:
    """Distances (n,) in metres from a point (3,) to triangles (n, 3, 3)."""
    a, b, c = corners.swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    edges = np.min([_to_segments(point, p, q) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    length = np.linalg.norm(normal, axis=1)
    flat = length > 0
    height = np.abs(np.sum((point - a) * normal, axis=1)) / np.where(flat, length, 1.0)
    inside = flat.copy()
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= np.sum(np.cross(q - p, point - p) * normal, axis=1) >= 0
    result: Array = np.where(inside, height, edges)
    return result


def _to_segments(point: Array, start: Array, end: Array) -> Array:
    along = end - start
    squared = np.sum(along * along, axis=1)
    part = np.sum((point - start) * along, axis=1) / np.where(squared > 0, squared, 1.0)
    nearest = start + np.clip(part, 0.0, 1.0)[:, None] * along
    distance: Array = np.linalg.norm(point - nearest, axis=1)
    return distance
