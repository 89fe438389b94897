"""Measures the distance from a robot to the static world, and finds the static solids that enclose a point.

A part is a solid of the static mesh, or one tile of a solid with many faces. A separate PyBullet client measures the
distance to each part near the robot.
"""

import itertools
import math
from collections.abc import Collection
from heapq import heappop, heappush, heapreplace

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose3, Vector
from simscen.core.geometry.meshes import FLOOR_HEIGHT_M, is_convex, submesh
from simscen.core.geometry.shapes import TriangleMesh
from simscen.sim.body import outline
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import collision_shapes, pybullet
from simscen.sim.bullet.client_pool import CLIENT_POOL
from simscen.sim.contact.triangles import LINE_TILT, encloses, encloses_along_line, point_to_triangles
from simscen.sim.scene.mesh_parts import parts_of

RELIST_DISTANCE_M = 4.0
"""Distance that the robot moves between two updates of the list of parts near it."""
SEARCH_SLACK_M = 0.15
"""Distance beyond the nearest part up to which other parts are measured."""
BULLET_MARGIN_M = 0.001
"""Collision margin of mesh shapes, which Bullet subtracts from distances."""
EXTENT_MARGIN_M = 0.002
"""Distance that a robot may extend beyond the vertices of its shapes."""
NEAREST_SLACK_M = 0.005
"""Additional search distance for the part that was nearest at the last measurement."""
SOLID_TOLERANCE_M = 0.05
"""Largest distance from a contact point to the bounding box of the touched part."""
CONTACT_DISTANCE = 8
"""Index of the distance in a contact point of PyBullet."""
ORIGIN, IDENTITY = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)

PartBound = tuple[float, int, tuple[float, float, float, float]]
"""Sort key, index, and bounding rectangle (left, low, right, high) in m of a part of the static mesh.

The sort key minus `StaticDistance._travel` is a lower bound in m of the present distance to the part.
"""


class StaticDistance:
    """Measures distances up to `max_range` m from one robot to the solids of a static world."""

    def __init__(self, static: TriangleMesh, robot: RobotBody, max_range: float) -> None:
        self._client = CLIENT_POOL.take()
        self._mesh, self._max_range = static, max_range
        radius, self._height = outline.radius_and_height(robot.collision_solids)
        self._radius, self._extent = radius + EXTENT_MARGIN_M, math.hypot(radius, self._height)
        self._hull_shapes = collision_shapes.create_robot_shapes(self._client, robot.collision_solids)
        self._parts = parts_of(static)
        self._shape_pairs: dict[int, list[tuple[int, int]]] = {}
        """Pairs (robot, part) of shape ids by part."""
        self._others: list[PartBound] = []
        """Heap of the parts near the robot, without the nearest part."""
        self._travel = 0.0
        """Upper bound of the distance that any point of the robot has moved since the start."""
        self._nearest: PartBound | None = None
        self._distance = math.inf
        self._pose, self._list_center = Pose3(), (math.inf, math.inf)
        self._above_floor: npt.NDArray[np.int64] = np.flatnonzero(self._parts.high[:, 2] > FLOOR_HEIGHT_M)
        low, high = self._parts.low[self._above_floor], self._parts.high[self._above_floor]
        self._rectangles = np.ascontiguousarray((low[:, 0], low[:, 1], high[:, 0], high[:, 1]))

    def distance(self, pose: Pose3) -> float:
        """Return the distance in m from the robot with its base frame at `pose` to the nearest solid; inf out of range.

        Only parts that may have become the nearest are measured again.
        """
        moved = max_displacement(self._pose, pose, self._extent)
        self._travel += moved
        self._pose = pose
        if math.dist(pose[:2], self._list_center) > RELIST_DISTANCE_M:
            self._list_parts(pose)
        nearest = math.inf
        if self._nearest is not None:
            nearest = self._measure(self._nearest[1], min(self._distance + moved + NEAREST_SLACK_M, self._max_range))
            if nearest == math.inf:
                heappush(self._others, self._nearest)
                self._nearest = None
        if self._others and self._others[0][0] < min(nearest, self._max_range) + self._travel:
            nearest = self._search_others(nearest)
        self._distance = nearest
        return nearest

    def _search_others(self, nearest: float) -> float:
        """Measure all parts that may be nearer than `nearest` m; return the new smallest distance in m."""
        others, travel, (x, y) = self._others, self._travel, self._pose[:2]
        # The top of a tilted robot extends beyond its radius.
        radius = self._radius + 2 * self._height * math.hypot(*self._pose[3:5])
        limit = min(nearest, self._max_range)
        # The sum `limit + travel` is compared, because rounding of a difference could repeat the loop forever.
        while others and others[0][0] < limit + travel:
            _, part, rectangle = others[0]
            left, low, right, high = rectangle
            bound = math.hypot(max(left - x, 0.0, x - right), max(low - y, 0.0, y - high)) - radius
            if bound < limit:
                bound = min(nearest + SEARCH_SLACK_M, self._max_range)
                found = self._measure(part, bound)
                if found < nearest:
                    heappop(others)
                    if self._nearest is not None:
                        heappush(others, (nearest + travel, *self._nearest[1:]))
                    self._nearest = 0.0, part, rectangle
                    nearest = limit = found
                    continue
                bound = min(found, bound)
            heapreplace(others, (bound + travel, part, rectangle))
        return nearest

    def _measure(self, part: int, max_distance: float) -> float:
        """Return the distance to one part; inf above `max_distance`."""
        pairs = self._shape_pairs.get(part)
        if pairs is None:
            pairs = self._shape_pairs[part] = list(itertools.product(self._hull_shapes, self._build_shapes(part)))
        position, quaternion, client = self._pose[:3], self._pose[3:], self._client
        nearest = math.inf
        for hull, shape in pairs:
            # Positional arguments, because keywords cost a fifth of the call.
            for point in pybullet.getClosestPoints(
                -1, -1, max_distance, -1, -1, hull, shape, position, ORIGIN, quaternion, IDENTITY, client
            ):
                nearest = min(nearest, point[CONTACT_DISTANCE] + BULLET_MARGIN_M)
        return nearest if nearest <= max_distance else math.inf

    def _list_parts(self, pose: Pose3) -> None:
        """Update the list of the parts that may come within range before the next update."""
        x, y = self._list_center = (pose.x, pose.y)
        left, low, right, high = self._rectangles
        outside = np.maximum(np.maximum(left - x, x - right), np.maximum(low - y, y - high))
        bounds = outside - (self._radius + self._height)  # too small for diagonal directions; refined when needed
        near = np.flatnonzero(bounds < self._max_range + RELIST_DISTANCE_M)
        parts, rectangles = self._above_floor[near].tolist(), map(tuple, self._rectangles[:, near].T.tolist())
        known = {part: bound for bound, part, _ in self._others}
        nearest_part = None if self._nearest is None else self._nearest[1]
        self._others = sorted(
            (max(bound, known.get(part, bound)), part, rectangle)
            for bound, part, rectangle in zip((bounds[near] + self._travel).tolist(), parts, rectangles, strict=True)
            if part != nearest_part
        )

    def _build_shapes(self, part: int) -> list[int]:
        """Create the shapes of a part; return their ids."""
        vertices, hulls, solid = self._mesh.vertices, self._mesh.hulls, int(self._parts.solids[part])
        if hulls and (hull := hulls[solid]):
            return [collision_shapes.create_convex_shape(self._client, vertices[hull])]
        faces = self._mesh.faces[self._parts.faces(part)]
        if len(self._parts.parts_of_solid(solid)) == 1 and is_convex(mesh := submesh(vertices, faces)):
            return [collision_shapes.create_convex_shape(self._client, mesh.vertices)]
        return collision_shapes.create_concave_shapes(self._client, vertices, faces)

    def enclosing_solids(self, point: Vector, exclude: Collection[int] = ()) -> list[int]:
        """Return the indices of the solids that enclose a point, except those in `exclude`."""
        return [k for k in self._parts.solids_around(point) if k not in exclude and self._encloses(k, point)]

    def _encloses(self, solid: int, point: Vector) -> bool:
        """Return whether a solid encloses a point; for a large solid, first tries a line that crosses few parts."""
        parts, vertices = self._parts, self._mesh.vertices
        solid_parts = parts.parts_of_solid(solid)
        if len(solid_parts) > 1:
            rows = slice(solid_parts.start, solid_parts.stop)
            low, high = parts.low[rows], parts.high[rows]
            tilt = max(LINE_TILT) * max(high[:, 2].max() - point[2], point[2] - low[:, 2].min())
            is_on_line = ((low[:, :2] - tilt <= point[:2]) & (point[:2] <= high[:, :2] + tilt)).all(axis=1)
            on_line = [parts.faces(part) for part, is_on in zip(solid_parts, is_on_line.tolist(), strict=True) if is_on]
            faces = np.concatenate([np.empty(0, np.int64), *on_line])
            is_enclosed = encloses_along_line(vertices[self._mesh.faces[faces]], point)
            if is_enclosed is not None:
                return is_enclosed
        return encloses(vertices[self._faces_of(solid)], point)

    def is_convex(self, solid: int) -> bool:
        """Return whether a solid is convex."""
        return is_convex(submesh(self._mesh.vertices, self._faces_of(solid)))

    def _faces_of(self, solid: int) -> npt.NDArray[np.int32]:
        return self._mesh.faces[self._parts.faces_of_solid(solid)]

    def name(self, solid: int) -> str:
        """Return the name of a solid."""
        return self._mesh.names[solid]

    def nearest_solid_name(self, point: Vector) -> str:
        """Return the name of the solid whose surface is nearest to a contact point, or "" if no solid is near."""
        position = np.array(point)
        outside = np.maximum(np.maximum(self._parts.low - position, position - self._parts.high), 0.0)
        near = np.flatnonzero((outside < SOLID_TOLERANCE_M).all(axis=1))
        if not len(near):
            return ""
        faces = np.concatenate([self._parts.faces(part) for part in near.tolist()])
        distances = point_to_triangles(position, self._mesh.vertices[self._mesh.faces[faces]])
        return self._mesh.names[int(self._mesh.owners[faces[int(np.argmin(distances))]])]

    def close(self) -> None:
        """Release the engine client."""
        CLIENT_POOL.release(self._client)


def max_displacement(before: Pose3, after: Pose3, extent: float) -> float:
    """Return an upper bound in m of the motion of any point within `extent` m of the base frame's origin."""
    return math.dist(before[:3], after[:3]) + 2 * extent * math.dist(before[3:], after[3:])
