"""How near the robot is to what never moves, solid by solid.

Asking the fused mesh would be exact too, but costs 0.6 µs for each triangle within reach: 20 to 40 ms of CPU for each
simulated second in a BARN world (28 facets a cylinder, 40 Hz). Here every solid that is convex is one convex shape,
built when the robot first comes near, of an engine of its own that is never stepped and has no bodies. A concave solid
as large as a map (188 000 triangles in one) is taken in tiles, each built and asked only when the robot is near it.
"""

import itertools
import math
from collections.abc import Collection
from heapq import heappop, heappush, heapreplace

import numpy as np
import numpy.typing as npt
import pybullet

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.meshes import FLOOR_HEIGHT_M, is_convex, submesh
from simscen.core.geometry.shapes import TriangleMesh
from simscen.sim.body import outline
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import engine
from simscen.sim.bullet.client_pool import CLIENT_POOL
from simscen.sim.scene.walls import parts_of

STRIDE = 4.0
"""m that the robot may move before the list of solids around it is made anew."""
SLACK = 0.15
"""m beyond the nearest within which others are measured too, so that they need not be asked again at once."""
MARGIN = 0.001
"""m by which Bullet takes a mesh for larger than it is; of a body it could be told not to, but one takes 0.2 ms."""
ROUNDED = 0.002
"""m that a robot may extend farther than the corners of its shapes, by which it is bounded."""
NO_PLACE, NO_TURN = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
NOISE = 0.005
"""m farther than the nearest may have gone within which it is measured; what lies farther costs time."""

Around = tuple[float, int, tuple[float, float, float, float]]
"""A lower bound of the distance to a part plus what had been travelled when that was known; the part; its extent."""


class StaticDistance:
    """The solids of a static world, as seen from one robot. `reach` is how far it looks, in meters."""

    def __init__(self, static: TriangleMesh, robot: RobotBody, reach: float) -> None:
        self._client = CLIENT_POOL.take()
        self._mesh, self._reach = static, reach
        radius, self._height = outline.radius_and_height(robot.solid)
        self._radius, self._extent = radius + ROUNDED, math.hypot(radius, self._height)
        self._hull = engine.hull_shapes(self._client, robot.solid)
        self._parts = parts_of(static)
        self._pairs: dict[int, list[tuple[int, int]]] = {}
        self._others: list[Around] = []
        """Parts around but for the nearest, as a heap: only while the first may be nearer has any to be looked at."""
        self._travelled = 0.0
        self._nearest: Around | None = None
        self._distance = math.inf
        self._pose, self._center = Pose3(), (math.inf, math.inf)
        self._standing: npt.NDArray[np.int64] = np.flatnonzero(self._parts.high[:, 2] > FLOOR_HEIGHT_M)
        low, high = self._parts.low[self._standing], self._parts.high[self._standing]
        self._extents = np.ascontiguousarray((low[:, 0], low[:, 1], high[:, 0], high[:, 1]))

    def distance(self, pose: Pose3) -> float:
        """Distance in meters from the robot, with its base at `pose`, to the nearest solid; inf beyond the reach.

        The distance to a part changes at most by what the robot moves, so only those are measured again that may have
        come nearer than the nearest, and the nearest no farther than it may have gone: what is asked costs time for
        each triangle within reach.
        """
        moved = max_displacement(self._pose, pose, self._extent)
        self._travelled += moved
        self._pose = pose
        if math.dist(pose[:2], self._center) > STRIDE:
            self._look_around(pose)
        nearest = math.inf
        if self._nearest is not None:
            nearest = self._measure(self._nearest[1], min(self._distance + moved + NOISE, self._reach))
            if nearest == math.inf:
                heappush(self._others, self._nearest)
                self._nearest = None
        if self._others and self._others[0][0] < min(nearest, self._reach) + self._travelled:
            nearest = self._look_for_nearer(nearest)
        self._distance = nearest
        return nearest

    def _look_for_nearer(self, nearest: float) -> float:
        """Measures the other parts that may be nearer, unless what they extend over is too far by now."""
        others, travelled, (x, y) = self._others, self._travelled, self._pose[:2]
        radius = self._radius + 2 * self._height * math.hypot(*self._pose[3:5])  # where it is tilted, its top leans
        limit = min(nearest, self._reach)
        # Sums are compared, for of two that are rounded alike the greater stays so: each bound of `limit` ends this.
        while others and others[0][0] < limit + travelled:
            _, part, extent = others[0]
            left, low, right, high = extent
            bound = math.hypot(max(left - x, 0.0, x - right), max(low - y, 0.0, y - high)) - radius
            if bound < limit:
                bound = min(nearest + SLACK, self._reach)
                found = self._measure(part, bound)
                if found < nearest:
                    heappop(others)
                    if self._nearest is not None:
                        heappush(others, (nearest + travelled, *self._nearest[1:]))
                    self._nearest = 0.0, part, extent
                    nearest = limit = found
                    continue
                bound = min(found, bound)
            heapreplace(others, (bound + travelled, part, extent))
        return nearest

    def _measure(self, part: int, within: float) -> float:
        """Distance to one part; inf if above `within`."""
        pairs = self._pairs.get(part)
        if pairs is None:
            pairs = self._pairs[part] = list(itertools.product(self._hull, self._build(part)))
        place, turn, client = self._pose[:3], self._pose[3:], self._client
        nearest = math.inf
        for hull, shape in pairs:
            # In the order of PyBullet's manual: names would cost a fifth of the call. Both shapes have places.
            for point in pybullet.getClosestPoints(
                -1, -1, within, -1, -1, hull, shape, place, NO_PLACE, turn, NO_TURN, client
            ):
                nearest = min(nearest, point[8] + MARGIN)
        return nearest if nearest <= within else math.inf

    def _look_around(self, pose: Pose3) -> None:
        """Lists the parts that may come within reach during the next stride."""
        x, y = self._center = (pose.x, pose.y)
        left, low, right, high = self._extents
        outside = np.maximum(np.maximum(left - x, x - right), np.maximum(low - y, y - high))
        bounds = outside - (self._radius + self._height)  # less than what is diagonal, which is told when it comes up
        near = np.flatnonzero(bounds < self._reach + STRIDE)
        parts, extents = self._standing[near].tolist(), map(tuple, self._extents[:, near].T.tolist())
        known = {part: bound for bound, part, _ in self._others}
        mine = None if self._nearest is None else self._nearest[1]
        self._others = sorted(
            (max(bound, known.get(part, bound)), part, extent)
            for bound, part, extent in zip((bounds[near] + self._travelled).tolist(), parts, extents, strict=True)
            if part != mine
        )

    def _build(self, part: int) -> list[int]:
        vertices, hulls = self._mesh.vertices, self._mesh.hulls
        if hulls and (own := hulls[self._parts.owners[part]]):
            return [engine.convex_shape(self._client, vertices[own])]
        faces = self._mesh.faces[self._parts.faces(part)]
        if self._parts.whole(part) and is_convex(solid := submesh(vertices, faces)):
            return [engine.convex_shape(self._client, solid.vertices)]
        lots = engine.tiles(vertices, engine.above_floor(vertices, faces))
        return [engine.concave_shape(self._client, submesh(vertices, lot)) for lot in lots]

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
            said = encloses_along_line(vertices[self._mesh.faces[faces]], place)
            if said is not None:
                return said
        return encloses(vertices[self._faces(owner)], place)

    def convex(self, owner: int) -> bool:
        """Whether a solid is convex."""
        return is_convex(submesh(self._mesh.vertices, self._faces(owner)))

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
        CLIENT_POOL.give_back(self._client)


def max_displacement(before: Pose3, after: Pose3, extent: float) -> float:
    """A bound on how far any point within `extent` of the base's origin has moved, in meters.

    A turn by an angle a moves it by 2 sin(a / 2) times that, and quaternions by 2 sin(a / 4).
    """
    return math.dist(before[:3], after[:3]) + 2 * extent * math.dist(before[3:], after[3:])


def point_to_triangles(point: Array, corners: Array) -> Array:
    """Distances (n,) in meters from a point (3,) to triangles (n, 3, 3)."""
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


Vector = tuple[float, float, float]
TILT = 0.0123, 0.0271
"""m by which the line through a place leans towards x and y for each m of its height: edges of maps lie upright."""


def encloses(corners: Array, place: Vector) -> bool:
    """Whether triangles (n, 3, 3), anticlockwise from outside, enclose a place.

    Sums up their solid angles (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 1983); small holes do no harm.
    """
    ax, ay, az, bx, by, bz, cx, cy, cz = np.ascontiguousarray(corners.reshape(-1, 9).T) - np.tile(place, 3)[:, None]
    la, lb, lc = (np.sqrt(x * x + y * y + z * z) for x, y, z in ((ax, ay, az), (bx, by, bz), (cx, cy, cz)))
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
    angles = 2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return bool(angles.sum() > 2 * math.pi)


def encloses_along_line(corners: Array, place: Vector) -> bool | None:
    """`winds_around`, told by those triangles (n, 3, 3) of a surface alone that a line through the place may meet.

    Whoever goes to infinity leaves a closed surface so often more than it enters it as it winds around the place. None
    where both ways along the line do not say the same, as through a hole, or where an edge lies on it.
    """
    x, y, z = np.moveaxis(corners - place, 2, 0)
    x, y = x - TILT[0] * z, y - TILT[1] * z
    # For each corner, twice the area that the line and the two others span: all are of one sign where it passes.
    areas = np.roll(x, -1, 1) * np.roll(y, -2, 1) - np.roll(x, -2, 1) * np.roll(y, -1, 1)
    passes = (areas >= 0).all(axis=1) | (areas <= 0).all(axis=1)
    areas, z = areas[passes], z[passes]
    if not areas.all():
        return None
    facing, above = np.sign(areas[:, 0]), (areas * z).sum(axis=1) * areas[:, 0] > 0
    up, down = facing[above].sum(), -facing[~above].sum()
    return bool(up > 0) if up == down else None
