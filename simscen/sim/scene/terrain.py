"""Ground on which robots drive: ramps and other uneven ground above the plane z = 0, and the friction of the floor."""

import math
from dataclasses import replace

import numpy as np

from simscen.core.environment.world_model import FloorPatch
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.meshes import drivable_solids, is_convex, submesh
from simscen.core.geometry.polygons import polygon_contains
from simscen.core.geometry.shapes import Body, TriangleMesh
from simscen.sim.bullet import collision_shapes, engine, pybullet

RAY_HEIGHT_M = 1000.0
"""Height above the floor from which vertical rays search the ground, and depth below the floor where they end."""
MIN_NORMAL_Z_WHEEL, MIN_NORMAL_Z_CASTER = 0.6, 0.1
"""Smallest z of the contact normal of a wheel or caster that stands on the ground. A smaller z means a collision."""


class Terrain:
    """Solids of a static world that wheels can roll on, as bodies in the engine. False if there are no such solids.

    `names` has the names of the solids by body id.
    """

    def __init__(self, client: int, static: TriangleMesh, max_step: float) -> None:
        """Create the solids that wheels can roll on. `max_step` is the highest step in m that a wheel can climb."""
        self._client = client
        solids = sorted(drivable_solids(static, max_step))
        self.names: dict[int, str | None] = {}
        self.obstacles = static
        """All other solids of the static world."""
        for solid in solids:
            self._add(static, solid)
        if solids:
            # Rays only hit bodies after a first collision detection.
            pybullet.performCollisionDetection(physicsClientId=client)
            is_obstacle = ~np.isin(static.owners, solids)
            faces, owners = static.faces[is_obstacle], static.owners[is_obstacle]
            self.obstacles = TriangleMesh(static.vertices, faces, owners, static.names)

    def __bool__(self) -> bool:
        return bool(self.names)

    def _add(self, static: TriangleMesh, solid: int) -> None:
        """Create the solid with the index `solid` in the engine."""
        # A convex solid becomes one shape, so that a wheel on a ramp does not bump into edges between triangles.
        faces = static.faces[static.owners == solid]
        mesh = submesh(static.vertices, faces)
        if is_convex(mesh):
            shapes = [collision_shapes.create_convex_shape(self._client, mesh.vertices)]
        else:
            shapes = collision_shapes.create_concave_shapes(self._client, static.vertices, faces)
        friction = static.frictions[solid] if static.frictions else 1.0
        for shape in shapes:
            body = engine.create_static_body(self._client, shape)
            pybullet.changeDynamics(
                body, -1, collisionMargin=0.0, lateralFriction=friction, physicsClientId=self._client
            )
            pybullet.setCollisionFilterGroupMask(
                body, -1, engine.TERRAIN, engine.EVERYTHING, physicsClientId=self._client
            )
            self.names[body] = static.names[solid]

    def heights(self, points: Array) -> Array:
        """Return the heights (n,) in m of the highest ground at points (n, 2)."""
        if not self.names:
            return np.zeros(len(points))
        above = np.column_stack((points, np.full(len(points), RAY_HEIGHT_M))).tolist()
        below = np.column_stack((points, np.full(len(points), -RAY_HEIGHT_M))).tolist()
        hits = pybullet.rayTestBatch(above, below, collisionFilterMask=engine.TERRAIN, physicsClientId=self._client)
        return np.array([max(0.0, hit[3][2]) if hit[0] in self.names else 0.0 for hit in hits])

    def raise_to_ground(self, body: Body) -> Body:
        """Return a body, raised to the ground if its origin is below the ground.

        A body at or above the height of the ground is returned unchanged, and also a body at a negative height.
        """
        height = float(self.heights(np.array([body.pose.position[:2]]))[0])
        return replace(body, pose=body.pose._replace(z=height)) if 0.0 <= body.pose.z < height else body

    def standing_pose(self, pose: Pose2, supports: Array) -> Pose3:
        """Return the 3D pose of a robot that stands at `pose` on the ground, tilted like the ground below it.

        `supports` (n, 2) are the points of wheels and casters in the base frame. No support is below the ground.
        """
        heights = self.heights(pose.apply(supports))
        if len(supports) < 3 or not np.ptp(heights):
            return Pose3.planar(pose, float(heights.max(initial=0.0)))
        plane, *_ = np.linalg.lstsq(np.column_stack((supports, np.ones(len(supports)))), heights, rcond=None)
        slope_x, slope_y, base = plane.tolist()
        lift = float((heights - supports @ plane[:2] - base).max())
        roll, pitch = math.atan2(slope_y, math.hypot(1.0, slope_x)), -math.atan(slope_x)
        tilt = Pose3.from_rpy(0.0, 0.0, 0.0, roll, pitch, 0.0)
        return Pose3.planar(pose, base + lift).compose(tilt)


class FloorFriction:
    """Named patches of the floor with their own friction coefficients; a newer patch covers older patches.

    A wheel gets the friction of the patch below the wheel. On a ramp, the engine multiplies this friction by the
    friction of the ramp.
    """

    def __init__(self) -> None:
        self._patches: dict[str, tuple[FloorPatch, tuple[float, float, float, float]]] = {}
        """Patches with their bounding boxes (min x, min y, max x, max y) in m, by name, oldest first."""
        self._has_expired = False

    def __bool__(self) -> bool:
        """Whether a patch exists or has existed, so that the friction of wheels must be updated."""
        return bool(self._patches) or self._has_expired

    def add(self, name: str, patch: FloorPatch) -> None:
        """Add a patch; replaces a patch of the same name."""
        xs, ys = zip(*patch.outline, strict=True)
        self._patches.pop(name, None)
        self._patches[name] = patch, (min(xs), min(ys), max(xs), max(ys))

    def remove_expired(self, tick: int) -> None:
        """Remove the patches that end at `tick` or before."""
        for name in [name for name, (patch, _) in self._patches.items() if patch.until <= tick]:
            self._has_expired = True
            del self._patches[name]

    def friction(self, x: float, y: float) -> float:
        """Return the friction coefficient of the newest patch at a point in m, or 1 if there is no patch."""
        coefficient = 1.0
        for patch, (left, low, right, high) in self._patches.values():
            if left <= x <= right and low <= y <= high and polygon_contains(patch.outline, (x, y)):
                coefficient = patch.friction
        return coefficient
