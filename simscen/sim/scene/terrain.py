"""Ground that is not level: what wheels roll on besides the plane z = 0, and how a robot stands there.

Each convex solid is one convex shape, so that a wheel which rolls over a ramp meets no edges between triangles. Concave
ones (height fields, meshes) stay triangles; on those a wheel loses some millimeters per second at each edge.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pybullet

from simscen.core.environment.world_model import Patch
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.meshes import Owners, drivable_solids, is_convex, submesh
from simscen.core.geometry.polygons import polygon_contains
from simscen.core.geometry.shapes import Body, TriangleMesh
from simscen.sim.bullet import engine

SKY = 1000.0
"""m above and below which nobody looks for ground."""
ON_WHEELS, ON_CASTERS = 0.6, 0.1
"""z of the unit normal above which a wheel or caster stands on what it touches; below, it has hit an edge too high.

A driven wheel gets up an edge of 0.29 of its radius by its own grip, and of 0.4 (this) with some run-up; a caster is
pushed over anything lower than its middle.
"""


class Terrain:
    """The solids of a static world that wheels may roll on, each a body of the engine's: `names` by its number.

    Where the world is flat there are none.
    """

    def __init__(self, client: int, static: TriangleMesh, reach: float) -> None:
        """`reach` is the highest step in m that any robot could get onto: the radius of its wheels."""
        self._client = client
        self.owners: Owners = drivable_solids(static, reach)
        self.names: dict[int, str | None] = {}
        self.rest = static
        """What stands in the world besides: walls to wheels."""
        for owner in sorted(self.owners):
            self._add(static, owner)
        if self.owners:
            # The engine's rays meet nothing that has never been looked at.
            pybullet.performCollisionDetection(physicsClientId=client)
            stays = ~np.isin(static.owners, sorted(self.owners))
            self.rest = TriangleMesh(static.vertices, static.faces[stays], static.owners[stays], static.names)

    def __bool__(self) -> bool:
        return bool(self.names)

    def _add(self, static: TriangleMesh, owner: int) -> None:
        whole = static.faces[static.owners == owner]
        solid = submesh(static.vertices, whole)
        if is_convex(solid):
            shapes = [engine.convex_shape(self._client, solid.vertices)]
        else:
            lots = engine.tiles(static.vertices, engine.above_floor(static.vertices, whole))
            shapes = [engine.concave_shape(self._client, submesh(static.vertices, lot)) for lot in lots]
        friction = static.frictions[owner] if static.frictions else 1.0
        for shape in shapes:
            body = engine.fixed(self._client, shape)
            pybullet.changeDynamics(
                body, -1, collisionMargin=0.0, lateralFriction=friction, physicsClientId=self._client
            )
            engine.touch(self._client, body, -1, engine.TERRAIN, engine.EVERYTHING)
            self.names[body] = static.names[owner]

    def heights(self, points: Array) -> Array:
        """The height (n,) in m of the ground at points (n, 2); of several floors the uppermost."""
        if not self.names:
            return np.zeros(len(points))
        above = np.column_stack((points, np.full(len(points), SKY))).tolist()
        below = np.column_stack((points, np.full(len(points), -SKY))).tolist()
        found = pybullet.rayTestBatch(
            above, below, collisionFilterMask=engine.TERRAIN, physicsClientId=self._client
        )  # fmt: skip
        return np.array([max(0.0, hit[3][2]) if hit[0] in self.names else 0.0 for hit in found])

    def lifted(self, body: Body) -> Body:
        """A thing that is put where its own frame is on the ground, which may be a platform."""
        height = float(self.heights(np.array([body.pose.position[:2]]))[0])
        return replace(body, pose=body.pose._replace(z=body.pose.z + height)) if height else body

    def seat(self, pose: Pose2, feet: Array) -> Pose3:
        """The base frame of a robot that is set down with its `feet` (n, 2), in its own frame, on the ground.

        It lies on the plane that fits the ground below them best, lifted so that none is inside of it.
        """
        heights = self.heights(pose.apply(feet))
        if len(feet) < 3 or not np.ptp(heights):
            return Pose3.planar(pose, float(heights.max(initial=0.0)))
        plane, *_ = np.linalg.lstsq(np.column_stack((feet, np.ones(len(feet)))), heights, rcond=None)
        ahead, left, base = plane.tolist()
        lift = float((heights - feet @ plane[:2] - base).max())
        tilt = Pose3.from_rpy(0.0, 0.0, 0.0, math.atan2(left, math.hypot(1.0, ahead)), -math.atan(ahead), 0.0)
        return Pose3.planar(pose, base + lift).compose(tilt)


def is_ground_contact(
    drivable_solids: Mapping[int, str | None], rolling: Mapping[int, float], other: int, link: int, up: float
) -> bool:
    """Whether a contact is that of a wheel or caster with the ground, rather than a collision.

    `rolling` are those links, and the least `up` at which they stand: the z of the unit normal towards the robot.
    `other` is the engine's number of what the robot's `link` touches.
    """
    return other in drivable_solids and link in rolling and up >= rolling[link]


class FloorFriction:
    """Patches of the floor by name; one that is laid later lies upon the others."""

    def __init__(self) -> None:
        self._patches: dict[str, tuple[Patch, tuple[float, float, float, float]]] = {}
        self._over = False

    def __bool__(self) -> bool:
        """Whether there has ever been one, so that wheels have to be looked after."""
        return bool(self._patches) or self._over

    def lay(self, name: str, patch: Patch) -> None:
        """Make a piece of floor slippery, or dry again; a patch of the same name is replaced."""
        xs, ys = zip(*patch.outline, strict=True)
        self._patches.pop(name, None)
        self._patches[name] = patch, (min(xs), min(ys), max(xs), max(ys))

    def pass_time(self, tick: int) -> None:
        """What is over by now dries up."""
        for name in [name for name, (patch, _) in self._patches.items() if patch.until <= tick]:
            self._over = True
            del self._patches[name]

    def friction(self, x: float, y: float) -> float:
        """At a place: that of the uppermost patch there, else 1."""
        found = 1.0
        for patch, (left, low, right, high) in self._patches.values():
            if left <= x <= right and low <= y <= high and polygon_contains(patch.outline, (x, y)):
                found = patch.friction
        return found
