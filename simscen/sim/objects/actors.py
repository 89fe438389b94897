"""All movable objects (actors) of a simulation.

A scripted actor follows a path. A pushable actor has a mass and no path. A deferred actor cannot collide yet, because
no robot has come near. A steered actor is a scripted actor whose path can change at any time, such as a pedestrian.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Pose3, Vector
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.sim.bullet import engine, pybullet
from simscen.sim.bullet.collision_shapes import Triangulate
from simscen.sim.contact.collisions import BodyMotion
from simscen.sim.contact.triangles import encloses
from simscen.sim.objects.actor import FALL_SPEED_M_S, Actor, ActorBuilder
from simscen.sim.objects.broad_phase import BroadPhase
from simscen.sim.objects.poses import ActorPoses
from simscen.sim.objects.proximity import DeferredActors, NearbyActors, ProximityQuery, find_nearby
from simscen.sim.objects.rest import RestDetector, RestPoses

NEVER = 2**62
"""A tick after the end of every run."""


class Actors:
    """All movable objects, sorted by name.

    Scripted actors are moved in the engine only if contact is possible. Pushable actors at rest sleep in the engine
    until an object comes near. Actors are deferred only if no actor is pushable.
    """

    def __init__(
        self, client: int, tick_rate: int, triangulate: Triangulate, visual_shape: int, is_rendered: bool
    ) -> None:
        """Begin without actors. If `is_rendered`, actors are in the engine with `visual_shape` even while deferred."""
        self._client, self._tick_rate = client, tick_rate
        self._builder = ActorBuilder(client, tick_rate, triangulate, visual_shape)
        self._is_rendered = is_rendered
        self._actors: dict[str, Actor] = {}
        self._no_contact_before: dict[int, int] = {}
        """For each robot's body id, the tick before which the robot cannot touch any actor."""
        self._nearby: dict[int, NearbyActors] = {}
        """Actors near each robot, by the robot's body id."""
        self._rest_poses = RestPoses()
        self._update_lists()

    def _update_lists(self) -> None:
        """Update the lists of actors, discard cached results, and wake all pushable actors."""
        actors = self._actors.values()
        self._scripted = [actor for actor in actors if actor.path is not None]
        self._scripted_colliding = [actor for actor in self._scripted if actor.can_collide]
        self._scripted_speed = max((actor.max_speed for actor in self._scripted), default=0.0)
        """Upper bound of the speed of all scripted actors in m/s."""
        self._pushable = [actor for actor in actors if actor.is_pushable]
        self._deferred: DeferredActors | None = None
        self._deferred_count = sum(not actor.can_collide for actor in actors)
        self.poses = ActorPoses(self._client, self._tick_rate, self._actors, self._no_contact_before)
        self._broad_phase = BroadPhase(self._client, self._tick_rate, self._scripted, self._pushable)
        self._nearby.clear()
        for actor in self._pushable:
            engine.wake(self._client, actor.id)  # the actor may have stood on a removed object

    # Adding, removing, and changing actors

    def add(self, body: Body, tick: int, is_steered: bool = False) -> None:
        """Add a body; replaces a body of the same name. If `is_steered`, `follow` can change its path."""
        self.remove(body.name)
        self._actors[body.name] = self._builder.make_actor(body, tick, is_steered)
        self._update_engine(tick)

    def add_all(self, bodies: Iterable[Body], tick: int) -> None:
        """Add bodies with new names."""
        self._actors.update((body.name, self._builder.make_actor(body, tick)) for body in bodies)
        self._update_engine(tick)

    def _update_engine(self, tick: int) -> None:
        """Create in the engine all actors that cannot be deferred; if actors are rendered, create all actors."""
        self._actors = dict(sorted(self._actors.items()))
        actors = self._actors.values()
        can_defer = not any(actor.is_pushable for actor in actors)
        for actor in actors:
            if actor.is_steered or not can_defer:
                self._builder.enable_collisions(actor, tick)
            elif self._is_rendered:
                self._builder.add_without_collisions(actor, tick)
        self._update_lists()

    @property
    def has_deferred(self) -> bool:
        """Whether any actor is deferred."""
        return bool(self._deferred_count)

    def activate_near(self, queries: Iterable[ProximityQuery], tick: int) -> dict[int, str | None]:
        """Let the deferred actors near robots collide, and add actors to the engine to measure their distances.

        Returns the names of these actors by body id.
        """
        if self._deferred is None:
            self._deferred = DeferredActors([actor for actor in self._actors.values() if not actor.can_collide])
        activated, measured = self._deferred.activate_near(queries)
        for actor in activated:
            self._builder.enable_collisions(actor, tick)
        for actor in measured:
            self._builder.add_without_collisions(actor, tick)
        if activated:
            self._deferred_count -= len(activated)
            self._scripted_colliding = [actor for actor in self._scripted if actor.can_collide]
        return {actor.id: actor.body.name for actor in (*activated, *measured)}

    def remove(self, name: str) -> None:
        """Remove a body; unknown names are ignored."""
        actor = self._actors.pop(name, None)
        if actor is not None:
            if actor.body_id is not None:
                pybullet.removeBody(actor.body_id, physicsClientId=self._client)
            self._update_lists()

    def move(self, name: str, path: MotionPath, tick: int) -> None:
        """Let a body follow a path from `tick` on; the body cannot be pushed any more."""
        actor = self._actors[name]
        self.add(replace(actor.body, pose=self.poses.at(tick)[name], mass=0.0, path=path), tick)

    def place(self, name: str, pose: Pose3, tick: int) -> None:
        """Place a body at rest at `pose`, and end its path."""
        self.add(replace(self._actors[name].body, pose=pose, path=None), tick)

    def follow(self, name: str, path: MotionPath, max_speed: float, tick: int) -> None:
        """Replace the path of a steered actor from `tick` on. The outline of the actor must be a circle.

        The path must begin at the current pose of the actor and must not exceed `max_speed` m/s.
        """
        self._actors[name].follow(path, max_speed, tick)
        self._scripted_speed = max(self._scripted_speed, max_speed)

    def motion(self, name: str, tick: int) -> tuple[MotionPath, float] | None:
        """Return the path that a body follows and the seconds since its start, or None if it follows no path."""
        actor = self._actors.get(name)
        if actor is None or actor.path is None:
            return None
        elapsed = (tick - actor.path_start_tick) / self._tick_rate
        return None if actor.path.has_ended(elapsed) else (actor.path, elapsed)

    # Pushing and sleeping

    @property
    def has_pushable(self) -> bool:
        """Whether any actor can be pushed."""
        return bool(self._pushable)

    def mass(self, name: str) -> float:
        """Return the mass in kg of a body, or 0 if it cannot be pushed or does not exist."""
        actor = self._actors.get(name)
        return actor.body.mass if actor is not None and actor.is_pushable else 0.0

    def wake(self, name: str) -> None:
        """Wake a body. It can be pushed one tick later, because Bullet discards forces on sleeping bodies."""
        if self.mass(name):
            engine.wake(self._client, self._actors[name].id)

    def push(self, name: str, impulse: tuple[float, float]) -> None:
        """Apply an impulse (x, y in N s, world frame) to a body during the next tick, if the body can be pushed."""
        if not self.mass(name):
            return
        body_id = self._actors[name].id
        center = pybullet.getBasePositionAndOrientation(body_id, physicsClientId=self._client)[0]
        force = (impulse[0] * self._tick_rate, impulse[1] * self._tick_rate, 0.0)
        pybullet.applyExternalForce(body_id, -1, force, center, pybullet.WORLD_FRAME, physicsClientId=self._client)
        self.poses.resting_since = None

    def make_rest_detector(self) -> RestDetector:
        """Return a detector of the pushable actors that are at rest."""
        return RestDetector(self._client, [actor.id for actor in self._pushable])

    def put_to_sleep(self, body_ids: Collection[int]) -> None:
        """Put bodies to sleep after the next step."""
        for body_id in body_ids:
            engine.put_to_sleep(self._client, body_id)
        self.poses.invalidate()

    def update_rest_poses(self, tick: int) -> None:
        """Record the poses of pushable actors that have not moved since the last call."""
        poses = self.poses.at(tick)
        self._rest_poses.update({actor.body.name: poses[actor.body.name] for actor in self._pushable})

    @property
    def rest_poses(self) -> Mapping[str, Pose3]:
        """Poses in which pushable actors have come to rest, by name."""
        return self._rest_poses.poses

    def on_push(self, tick: int) -> None:
        """Discard the result of the broad phase, because something is pushed during the step that begins at `tick`."""
        self._broad_phase.invalidate(tick)

    def no_push_before(self, tick: int, robot_speed: Callable[[], float]) -> int:
        """Return a tick before which no scripted actor can push anything; -1 if this is possible in the next step.

        Wakes the pushable actors that may be touched soon. `robot_speed` returns an upper bound in m/s of the speed of
        all robots.
        """
        if not (self._scripted and self._pushable):
            return NEVER
        broad_phase = self._broad_phase
        if tick >= broad_phase.valid_until and broad_phase.update(
            tick, robot_speed(), self.poses.at(tick), self.poses.are_pushable_asleep(tick)
        ):
            self.poses.resting_since = None
        return -1 if broad_phase.near_contact else broad_phase.valid_until

    def set_no_contact_before(self, robot_id: int, tick: int) -> None:
        """Store the tick before which the robot with the body id `robot_id` cannot touch any actor."""
        self._no_contact_before[robot_id] = tick

    # Stepping

    def begin_step(self, tick: int, all_scripted: bool = True) -> None:
        """Set the poses and velocities of scripted actors in the engine before the step that begins at `tick`.

        Without `all_scripted`, affects only the scripted actors that may push something soon.
        """
        for actor in self._scripted_colliding if all_scripted else self._broad_phase.near_contact:
            actor.set_engine_pose(self._client, actor.path_pose(tick, self._tick_rate))
            velocity, turn_rate = actor.path_velocity(tick, self._tick_rate)
            if turn_rate or any(velocity):
                pybullet.resetBaseVelocity(actor.id, velocity, (0.0, 0.0, turn_rate), physicsClientId=self._client)

    def end_step(self, tick: int, all_scripted: bool = True) -> None:
        """Set the poses of scripted actors in the engine after the step that ended at `tick`; see `begin_step`."""
        for actor in self._scripted_colliding if all_scripted else self._broad_phase.near_contact:
            actor.set_engine_pose(self._client, actor.path_pose(tick, self._tick_rate))

    def update_rendered_poses(self, tick: int) -> None:
        """Set the poses of all scripted actors in the engine, including deferred actors, to render an image."""
        for actor in self._scripted:
            actor.set_engine_pose(self._client, actor.path_pose(tick, self._tick_rate))

    def motions(self, tick: int) -> dict[int, BodyMotion]:
        """Return the motions of all actors that can collide and move, by body id. Their rotation is ignored."""
        scripted = {actor.id: actor.path_velocity(tick, self._tick_rate)[0] for actor in self._scripted_colliding}
        pushable = {actor.id: pybullet.getBaseVelocity(actor.id, self._client)[0] for actor in self._pushable}
        zero = (0.0, 0.0, 0.0)
        return {body_id: BodyMotion(zero, linear, zero) for body_id, linear in {**scripted, **pushable}.items()}

    # Bodies

    def bodies_and_poses(self, tick: int) -> dict[str, tuple[Body, Pose3]]:
        """Return all bodies and their poses, sorted by name."""
        return {name: (self._actors[name].body, pose) for name, pose in self.poses.at(tick).items()}

    def bodies(self) -> dict[str, Body]:
        """Return all bodies, sorted by name."""
        return {name: actor.body for name, actor in self._actors.items()}

    def names_by_id(self) -> dict[int, str | None]:
        """Return the names of all actors in the engine by body id."""
        return {actor.body_id: name for name, actor in self._actors.items() if actor.body_id is not None}

    def find_enclosing(self, point: Vector, tick: int) -> str | None:
        """Return the name of the first actor with a `surface` that encloses a point, or None."""
        for name, pose in self.poses.at(tick).items():
            surface = self._actors[name].surface
            if surface is not None:
                x, y, z = pose.inverse().apply(np.array(point)).tolist()
                if encloses(surface.vertices[surface.faces], (x, y, z)):
                    return name
        return None

    # Distances and speeds

    def prepare_nearby(
        self, robot_id: int, point: Vector, distance: float, ground_distance: float, tick: int
    ) -> list[int]:
        """Return the body ids of the actors that may be within `distance` m of a robot's position `point`.

        Sets the poses of these actors in the engine. If none of them moves, returns only the actors that may be within
        `ground_distance` m, measured in the ground plane.
        """
        poses = self.poses.at(tick)
        asleep_since = self.poses.resting_since if not self._pushable or self.poses.are_pushable_asleep(tick) else None
        max_step = self._scripted_speed / self._tick_rate
        nearby = self._nearby.get(robot_id)
        if nearby is None or nearby.asleep_since != asleep_since or not nearby.covers(point, distance, tick, max_step):
            nearby = find_nearby(self._actors.values(), poses, point, distance, tick, asleep_since)
            self._nearby[robot_id] = nearby
        return nearby.prepare_nearby(self._client, point, distance, ground_distance, poses)

    def free_distance(self, robot_id: int, point: Vector, distance: float, tick: int) -> float | None:
        """Return a lower bound of the distance in m from `point` to the nearest actor, minus `distance`.

        Call `prepare_nearby` first. Returns None if any actor is pushable or steered.
        """
        nearby = self._nearby[robot_id]
        if self._pushable or any(actor.is_steered for actor in self._scripted):
            return None
        travel = self.max_scripted_travel(tick - nearby.tick)
        return nearby.free_distance(point, self.poses.at(tick), travel) - distance

    def max_scripted_travel(self, ticks: int) -> float:
        """Return an upper bound in m of the distance that a scripted actor moves within `ticks`."""
        return self._scripted_speed * ticks / self._tick_rate

    def reachable_spheres(self, tick: int, ticks: int) -> Iterator[tuple[int, Vector, float]]:
        """Yield a sphere (body id, center, radius in m) that each pushable actor cannot leave within `ticks`."""
        if self._pushable:
            poses, travel = self.poses.at(tick), self.speed_bound(tick) * ticks / self._tick_rate
            for actor in self._pushable:
                yield actor.id, poses[actor.body.name].position, actor.bounding_radius + travel

    def speed_bound(self, tick: int) -> float:
        """Return an upper bound in m/s of the speed of any actor for the next SPEED_HORIZON_S."""
        if not self._pushable:
            return self._scripted_speed
        self.poses.at(tick)
        # A body that is hit by a heavier one leaves with up to twice its speed.
        factor = 2 if len(self._pushable) > 1 else 1
        if self.poses.are_pushable_asleep(tick):
            return max(self._scripted_speed, FALL_SPEED_M_S) * factor
        return max(self._scripted_speed, *(actor.speed_bound(self._client) for actor in self._pushable)) * factor
