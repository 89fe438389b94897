"""One robot of a simulation: its motion, collisions, and clearance."""

import math
from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt

from simscen.core.errors import RunError
from simscen.core.geometry import Pose2, Pose3, Vector
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, TriangleMesh
from simscen.core.records.events import Event
from simscen.core.records.trace import DeferredTruth, Truth
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import pybullet
from simscen.sim.bullet.divergence import divergence_reason
from simscen.sim.contact.clearance import Clearance
from simscen.sim.contact.collisions import BodyMotion, CollisionTracker, ContactPoint
from simscen.sim.objects.actors import NEVER
from simscen.sim.objects.proximity import ProximityQuery
from simscen.sim.robots.drive_factory import build_drive
from simscen.sim.robots.robot_state import PendingTruth, RobotState
from simscen.sim.scene.camera import render_image
from simscen.sim.scene.scene import Scene

_new = tuple.__new__
"""Creates a named tuple without the call overhead of its class."""
NO_BODY = -1
"""Invalid body id."""


class Robot:
    """A robot that can be driven and observed. Implements `SensorView`."""

    def __init__(
        self,
        name: str,
        scene: Scene,
        static: TriangleMesh,
        obstacles: TriangleMesh,
        body: RobotBody,
        pose: Pose2,
        period: float,
        clearance_range: float,
        visual_shape: int,
    ) -> None:
        """Place the robot at `pose`. Its firmware runs every `period` seconds.

        `obstacles` is the part of the `static` world that counts for the clearance. The clearance is measured up to
        `clearance_range` m. `visual_shape` is the id of the shape that the renderer shows.
        """
        self.name, self._scene = name, scene
        self.base, self._drive = build_drive(scene, body, pose, period, visual_shape)
        self.advance = self._drive.advance
        """Function that runs one period of the firmware."""
        self._command: Twist | None = None
        self._state_tick, self._cached_state = scene.tick, self.base.state()
        self._label = f'robot "{name}"' if name else "the robot"
        self.others: tuple[Robot, ...] = ()
        """The other robots, sorted by name."""
        self.bodies: Mapping[str, Body] = {}
        """All movable objects and other robots by name. A change replaces the mapping."""
        self.body = Body(name, body.collision_solids, Pose3.planar(pose), body.mass)
        self._collisions = CollisionTracker(scene.tick_rate)
        self._placements, self._placed_tick = 0, -1
        self.clearance = Clearance(scene, static, obstacles, body, self.base, self.state, clearance_range)
        self._deferred: list[PendingTruth] = []
        """Samples whose clearances are computed in one batch, when one of them is needed."""
        self._names: dict[int, str | None] = {}
        """Names of all bodies that the robot can touch, by body id (None: a wall)."""
        self._query_point: Vector = (math.inf, math.inf, math.inf)
        """Position of the robot at the last call of `make_query`."""

    # Driving and observing

    def drive(self, command: Twist) -> None:
        """Command a velocity in the base frame. The base follows within its limits."""
        if command is not self._command:  # most commands are the previous object again
            self._command = command
            self._drive.command(command)

    def truth(self) -> Truth:
        """Return the true state; raises RunError if the physics has diverged."""
        tick = self._scene.tick
        return self._truth(tick, self._checked_state(tick))

    def sample(self, period: int) -> Truth | DeferredTruth:
        """Return the true state, or a sample whose clearance is computed later if that is possible.

        The caller must take the next sample at most `period` ticks later. Raises RunError if the physics has diverged.
        """
        tick = self._scene.tick
        state = self._checked_state(tick)
        self._scene.actors.poses.prefetch(tick, period)
        if not self._collisions.is_colliding and self.clearance.can_defer(tick, period, state.pose):
            sample = PendingTruth(self.compute_deferred, state, self.objects())
            self._deferred.append(sample)
            return sample
        self.compute_deferred()
        return self._truth(tick, state, period)

    def compute_deferred(self) -> None:
        """Compute the clearances of all deferred samples. In these samples, the static world is nearest."""
        deferred, self._deferred = self._deferred, []
        for sample in deferred:
            state = sample.state
            clearance = self.clearance.static_clearance(state.pose)
            sample.result = _new(Truth, (state.pose, state.twist, clearance, sample.objects))

    def _checked_state(self, tick: int) -> RobotState:
        """Return the state; raises RunError if the physics of the robot or of a movable object has diverged."""
        (x, y, z, i, j, k, w), (vx, vy, vz), (wx, wy, wz) = state = self.state()
        actors = self._scene.actors
        reason = divergence_reason(self._label, x, y, z, i + j + k + w + vx + vy + vz + wx + wy + wz)
        if reason is None and actors.has_pushable:
            reason = actors.poses.find_divergence(tick)
        if reason is not None:
            raise RunError("diverged", f"simulation diverged at t={tick / self._scene.tick_rate:.3f} s: {reason}")
        return state

    def _truth(self, tick: int, state: RobotState, period: int = NEVER) -> Truth:
        """Return the true state with its clearance. `period` is the number of ticks until the next call."""
        clearance = self.clearance.measure(tick, period)
        if self._collisions.has_contact_at(tick):
            clearance = min(clearance, 0.0)  # surfaces in contact can have a tiny distance
        return Truth(state.pose, state.twist, clearance, self.objects())

    def collisions(self) -> tuple[Event, ...]:
        """Return the events collision.started and collision.ended since the last call."""
        return self._collisions.take_events()

    def objects(self) -> Mapping[str, Pose3]:
        """Return the poses of all movable objects and of the other robots by name."""
        poses = self._scene.actors.poses.at(self._scene.tick)
        return {**poses, **{robot.name: robot.base_pose() for robot in self.others}} if self.others else poses

    @property
    def rest_poses(self) -> Mapping[str, Pose3]:
        """Last poses in which pushable objects were at rest, by name."""
        return self._scene.actors.rest_poses

    def bodies_and_poses(self) -> Mapping[str, tuple[Body, Pose3]]:
        """Return all movable objects and other robots with their poses by name."""
        return {name: (self.bodies[name], pose) for name, pose in self.objects().items()}

    def state(self) -> RobotState:
        """Return the current pose and velocity; queries the engine at most once per tick."""
        tick = self._scene.tick
        if tick != self._state_tick:
            self._state_tick, self._cached_state = tick, self.base.state()
        return self._cached_state

    def base_pose(self) -> Pose3:
        """Return the pose of the base frame in the world."""
        return self.state().pose

    def base_velocity(self) -> tuple[Vector, Vector]:
        """Return the linear (m/s) and angular (rad/s) velocity of the base frame along the world axes."""
        state = self.state()
        return state.linear, state.angular

    def encoders(self) -> tuple[float, ...]:
        """Return the accumulated rotation of the wheels; see `SensorView.encoders`."""
        return self._drive.encoders()

    def placements(self) -> int:
        """Return how many times the robot has been teleported."""
        return self._placements

    def touching(self) -> bool:
        """Return whether the robot touches anything, or did so less than 0.1 s ago.

        Wheels and casters on the ground do not count.
        """
        tick = self._scene.tick
        return self._collisions.is_colliding or (tick == self._placed_tick and self.clearance.measure(tick) <= 0.0)

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """Return colors (height, width, 3) and depths (height, width) in m; see `SensorView.image`."""
        render_scene = self._scene.render_scene
        assert render_scene is not None, "the simulation was built without images"
        self._scene.actors.update_rendered_poses(self._scene.tick)
        render_scene.update(self.bodies_and_poses())
        return render_image(self._scene.client, self.base_pose().compose(mount), width, height, field_of_view, far)

    # Called by the simulation

    def place(self, pose: Pose2) -> None:
        """Place the robot at rest at `pose`, and end its collisions."""
        self._collisions.end_all(self._scene.tick)
        self._placements, self._placed_tick = self._placements + 1, self._scene.tick
        self.set_pose(pose)

    def set_pose(self, pose: Pose2) -> None:
        """Place the robot at rest at `pose`. Unlike `place`, this is no teleportation, and ends no collisions."""
        self.base.place(pose)
        self._state_tick = -1
        self._drive.rest()

    def push(self, impulse: tuple[float, float]) -> None:
        """Apply an impulse (N s, world frame) at the center of mass during the next tick."""
        self.base.push(impulse, 1 / self._scene.tick_rate)

    def on_change(self, robots: Iterable["Robot"]) -> None:
        """Update the lists of other robots and objects after an object or one of the `robots` has changed."""
        scene = self._scene
        self.others = tuple(robot for robot in robots if robot is not self)
        self.clearance.others = [robot.clearance for robot in self.others]
        self.bodies = {**scene.actors.bodies(), **{robot.name: robot.body for robot in self.others}}
        robot_names = {robot.base.id: robot.name for robot in self.others}
        self._names = {
            **dict.fromkeys(scene.walls.bodies),
            **scene.terrain.names,
            **scene.actors.names_by_id(),
            **robot_names,
        }
        self.clearance.invalidate()

    @property
    def distance_since_query(self) -> float:
        """Distance in m that the robot has moved since the last call of `make_query`."""
        return math.dist(self._query_point, self.state().pose[:3])

    def make_query(self) -> ProximityQuery:
        """Return the position and the search radii of the robot, to find deferred actors near it."""
        self._query_point = self.state().pose.position
        return ProximityQuery(self._query_point, self.clearance.contact_radius, self.clearance.distance_radius)

    def add_bodies(self, names: Mapping[int, str | None]) -> None:
        """Add bodies that the robot can touch, by body id (None: a wall)."""
        self._names.update(names)

    @property
    def no_contact_before(self) -> int:
        """Tick before which the robot cannot touch anything; -1 during a collision."""
        return -1 if self._collisions.is_colliding else self.clearance.no_contact_before

    def before_contact_step(self) -> BodyMotion:
        """Return the current motion before a step with possible contact, and update the clearance if needed."""
        tick, clearance = self._scene.tick, self.clearance
        is_outdated = tick >= clearance.no_contact_before and not self._collisions.is_colliding
        if clearance.may_be_enclosed or is_outdated:
            clearance.measure(tick)
        state = self.state()
        return BodyMotion(state.pose.position, state.linear, state.angular)

    def after_contact_step(self, motions: Mapping[int, BodyMotion]) -> None:
        """Record the robot's contacts after a step. `motions` has the motions of all bodies before the step, by id."""
        tick, clearance, motion = self._scene.tick, self.clearance, motions[self.base.id]
        if not self._collisions.is_colliding and tick <= clearance.no_contact_before:
            return
        contacts = self.contacts()
        enclosing = clearance.enclosed_by
        if enclosing is not None and enclosing not in {contact.name for contact in contacts}:
            up = (0.0, 0.0, 1.0)
            contacts.append(ContactPoint(enclosing, NO_BODY, motion.origin, up, 0.0))
        self._collisions.update(tick, contacts, motion, motions)

    def contacts(self) -> list[ContactPoint]:
        """Return the current contacts, one for each touched object, sorted by name.

        Wheels and casters on the ground do not count.
        """
        scene, names, ground_links = self._scene, self._names, self.base.ground_links
        tick_seconds = 1 / scene.tick_rate
        found: dict[str, ContactPoint] = {}
        for contact in pybullet.getContactPoints(self.base.id, physicsClientId=scene.client):
            other, link, (point, normal, distance, force) = contact[2], contact[3], contact[6:10]
            if other not in names or (force <= 0 and distance > 0):
                continue
            if other in scene.terrain.names and normal[2] >= ground_links.get(link, math.inf):
                continue  # a wheel or caster on the ground
            name = names[other] or self.clearance.static_solid_at(point)
            known = found.get(name)
            impulse = force * tick_seconds + (known.impulse if known else 0.0)
            found[name] = ContactPoint(name, other, point, normal, impulse)
        return [found[name] for name in sorted(found)]

    def close(self) -> None:
        """Compute the deferred samples, and release the engine clients that measure the clearance."""
        self.compute_deferred()
        self.clearance.close()
