"""State of one movable object (actor), and its creation in the engine.

A scripted actor follows a path and has no mass in the engine. A pushable actor has a mass and no path. All other actors
stand still.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.errors import RunError
from simscen.core.geometry import Pose3, Vector, wrap
from simscen.core.geometry.motion_paths import (
    MAX_STEP_M,
    PathSampler,
    SweptSegment,
    largest_step,
    swept_segments,
    too_fast_message,
    top_speed,
)
from simscen.core.geometry.shapes import Body, Mesh, MotionPath
from simscen.sim.body.inertia import inertia_of_solids
from simscen.sim.body.outline import radius_and_height
from simscen.sim.bullet import collision_shapes, engine, pybullet
from simscen.sim.bullet.collision_shapes import Triangulate

FRICTION = 0.6
"""Friction coefficient of movable objects on the ground, about as for wood on concrete."""
SPEED_HORIZON_S = 0.1
"""Time in the future for which upper bounds of speeds are valid."""
FALL_SPEED_M_S = SPEED_HORIZON_S * GRAVITY_M_S2
"""Speed that a resting object can gain by falling for SPEED_HORIZON_S."""
SHAPE_MARGIN_M = 0.05
"""Distance that collision shapes may extend beyond their vertices."""

CenterPose = tuple[Vector, tuple[float, float, float, float]]
"""Position and quaternion of a center of mass, as returned by PyBullet."""


@dataclass
class Actor:
    """A movable body, and the `path` that the body has followed since `path_start_tick` (None: no path).

    segments:         line segments along the initial path, each with a `deviation` in m: the origin of the body is
                      always within this distance of one of the segments. `follow` does not update them.
    max_speed:        upper bound in m/s of the speed of any point of the body on the path
    bounding_radius:  radius in m of the bounding sphere around the origin of the body
    cylinder_radius:  radius in m of the bounding cylinder around the vertical axis of the body
    surface:          surface in the body frame if the collision shape is a hollow triangle mesh, else None
    """

    body: Body
    path: MotionPath | None
    path_start_tick: int
    segments: Sequence[SweptSegment]
    max_speed: float
    bounding_radius: float
    cylinder_radius: float
    surface: Mesh | None
    is_steered: bool = False
    """Whether the path can be replaced at any time, as for pedestrians."""
    body_id: int | None = None
    """Body id in the engine; None if the actor is not in the engine."""
    can_collide: bool = False
    """Whether the actor is in the engine and can collide."""
    engine_pose: Pose3 | None = None
    """Pose at which the actor was last placed in the engine."""
    center_from_base: Pose3 = Pose3()
    """Pose of the body frame in the frame of the principal axes of inertia."""
    center_and_pose: tuple[CenterPose, Pose3] | None = None
    """Pose of the center of mass at the last query of the engine, and the resulting pose of the body frame."""
    is_resting: bool = False
    """Whether the engine returned the same pose at the last two queries."""
    _sampler: PathSampler | None = None
    _path_poses: dict[int, Pose3] = field(default_factory=dict)
    """Cache of recent path poses by tick."""

    @property
    def id(self) -> int:
        """Body id in the engine; raises LookupError if the actor is not in the engine."""
        if self.body_id is None:
            raise LookupError(f'"{self.body.name}" is not in the engine')
        return self.body_id

    @property
    def is_pushable(self) -> bool:
        """Whether the actor can be pushed: the body has a mass, and the actor has no path."""
        return self.body.mass > 0 and self.path is None

    def is_parked(self, elapsed: float, horizon: float) -> bool:
        """Return whether the actor stands still for `horizon` seconds, from `elapsed` seconds after its path began.

        Always False for an actor that has no path or is steered.
        """
        if self.path is None or self.is_steered:
            return False
        return self.path.has_ended(elapsed) or elapsed + horizon < self.path.start

    def follow(self, path: MotionPath, max_speed: float, tick: int) -> None:
        """Follow another path from `tick` on. The path must not exceed `max_speed` m/s."""
        self.path, self.path_start_tick, self.max_speed, self._sampler = path, tick, max_speed, None
        self._path_poses.clear()

    def path_pose(self, tick: int, tick_rate: int) -> Pose3:
        """Return the pose on the path at a tick."""
        pose = self._path_poses.get(tick)
        if pose is None:
            if len(self._path_poses) > 1:
                self._path_poses.clear()
            if self._sampler is None:
                assert self.path is not None
                self._sampler = PathSampler(self.path, self.body.pose.z)
            self._path_poses[tick] = pose = self._sampler.at((tick - self.path_start_tick) / tick_rate)
        return pose

    def path_velocity(self, tick: int, tick_rate: int) -> tuple[Vector, float]:
        """Return the velocity in m/s and turn rate in rad/s on the path until the next tick; 0 if the path jumps."""
        pose, next_pose = self.path_pose(tick, tick_rate), self.path_pose(tick + 1, tick_rate)
        vx, vy = (next_pose.x - pose.x) * tick_rate, (next_pose.y - pose.y) * tick_rate
        if math.hypot(vx, vy) > MAX_STEP_M * tick_rate:  # a jump of the path is a teleportation, not a motion
            return (0.0, 0.0, 0.0), 0.0
        return (vx, vy, 0.0), wrap(next_pose.yaw - pose.yaw) * tick_rate

    def ground_radius(self, pose: Pose3) -> float:
        """Return the radius in m of a disc around the origin of the body that contains its outline from above."""
        height = math.sqrt(self.bounding_radius**2 - self.cylinder_radius**2)
        return min(self.bounding_radius, self.cylinder_radius + 2 * height * math.hypot(pose.qx, pose.qy))

    def distance_to(self, point: Vector, pose: Pose3) -> float:
        """Return the distance in m from a point to `pose` or `engine_pose`, whichever is nearer."""
        distance = math.dist(pose[:3], point)
        return distance if self.engine_pose is None else min(distance, math.dist(self.engine_pose[:3], point))

    def set_engine_pose(self, client: int, pose: Pose3) -> None:
        """Set the pose of the actor in the engine. Has no effect if the actor is not in the engine."""
        if self.body_id is not None and pose != self.engine_pose:
            self.engine_pose = pose
            pybullet.resetBasePositionAndOrientation(self.id, pose[:3], pose[3:], client)

    def update_pose(self, client: int) -> bool:
        """Query the pose of a pushable actor from the engine; return whether it has moved since the last query."""
        center: CenterPose = pybullet.getBasePositionAndOrientation(self.id, client)
        self.is_resting = self.center_and_pose is not None and self.center_and_pose[0] == center
        if not self.is_resting:
            self.center_and_pose = center, Pose3(*center[0], *center[1]).compose(self.center_from_base)
        return not self.is_resting

    def speed_bound(self, client: int) -> float:
        """Return an upper bound in m/s of the speed of any point of a pushable actor within SPEED_HORIZON_S."""
        if self.is_resting:
            return FALL_SPEED_M_S
        linear, angular = pybullet.getBaseVelocity(self.id, physicsClientId=client)
        return math.hypot(*linear) + math.hypot(*angular) * self.bounding_radius + FALL_SPEED_M_S


class ActorBuilder:
    """Creates actors, and their bodies in the engine."""

    def __init__(self, client: int, tick_rate: int, triangulate: Triangulate, visual_shape: int) -> None:
        """Take the id of the engine's client, and the id of the visual shape of all actors."""
        self._client, self._tick_rate = client, tick_rate
        self._triangulate, self._visual_shape = triangulate, visual_shape

    def make_actor(self, body: Body, tick: int, is_steered: bool = False) -> Actor:
        """Return an actor that is not in the engine yet, whose path begins at `tick`.

        Raises RunError if the path is too fast.
        """
        radius, height = radius_and_height(body.solids)
        if body.path is not None and (step := largest_step(body.path, 1 / self._tick_rate, radius)) > MAX_STEP_M:
            raise RunError("invalid", too_fast_message(body.name, step))
        segments, speed = [SweptSegment(body.pose.x, body.pose.y, body.pose.x, body.pose.y)], 0.0
        if body.path is not None:
            segments, speed = swept_segments(body.path), top_speed(body.path, radius)
        surface = None
        if not (collision_shapes.are_primitives(body.solids) or (body.mass > 0 and body.path is None)):
            surface = collision_shapes.fuse_surfaces(body.solids, self._triangulate)
        bounding_radius = math.hypot(radius, height)
        return Actor(body, body.path, tick, segments, speed, bounding_radius, radius, surface, is_steered)

    def enable_collisions(self, actor: Actor, tick: int) -> None:
        """Let an actor collide; creates it in the engine if necessary."""
        if actor.can_collide:
            return
        if actor.body_id is None:
            self._create(actor, tick)
        else:
            engine.enable_collisions(self._client, actor.id)
            if actor.path is not None:
                actor.set_engine_pose(self._client, actor.path_pose(tick, self._tick_rate))
        actor.can_collide = True

    def add_without_collisions(self, actor: Actor, tick: int) -> None:
        """Create an actor in the engine without collisions, to measure distances and for rendering.

        Has no effect if the actor is in the engine already.
        """
        if actor.body_id is None:
            self._create(actor, tick)
            engine.disable_collisions(self._client, actor.id)

    def _create(self, actor: Actor, tick: int) -> None:
        """Create the body of an actor in the engine, at its pose at `tick`."""
        client, body, visual = self._client, actor.body, self._visual_shape
        shape = collision_shapes.create_body_shape(client, body.solids, actor.is_pushable, self._triangulate)
        if actor.is_pushable:
            inertia = inertia_of_solids(body.solids, body.mass).principal()
            actor.center_from_base = inertia[1].inverse()
            actor.body_id = engine.create_rigid_body(client, body.mass, shape, body.pose, inertia, FRICTION, visual)
        elif actor.path is None:
            actor.body_id = engine.create_static_body(client, shape, visual, body.pose, FRICTION)
        else:
            actor.body_id = engine.create_rigid_body(
                client, 0.0, shape, body.pose, ((0.0, 0.0, 0.0), Pose3()), FRICTION, visual
            )
        if actor.path is None:
            actor.engine_pose = body.pose
        else:
            # Setting the pose again makes it bit-identical to the pose of an actor that was created earlier.
            actor.set_engine_pose(client, actor.path_pose(tick, self._tick_rate))
