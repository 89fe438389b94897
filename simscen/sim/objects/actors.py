"""Things that move: by a script, or because they are pushed."""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np
import pybullet

from simscen.core.errors import RunError
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.motion_paths import (
    MAX_STEP_M,
    SweptSegment,
    largest_step,
    swept_segments,
    too_fast,
    top_speed,
)
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.sim.body.inertia import inertia_of_solids
from simscen.sim.body.outline import radius_and_height
from simscen.sim.bullet import engine
from simscen.sim.bullet.divergence import divergence_reason
from simscen.sim.contact.static_distance import encloses
from simscen.sim.objects.actor import FALLING, Actor, ScheduledPoses, Vector
from simscen.sim.objects.broad_phase import BroadPhase
from simscen.sim.objects.proximity import DeferredActors, NearbyActors, ProximityQuery, find_nearby
from simscen.sim.objects.rest import RestDetector, RestPoses

FRICTION = 0.6
"""Of pushable things on the ground: about that of wood or cardboard on concrete."""
NEVER = 2**62
"""A tick that never comes."""


class Actors:
    """All that moves but the robots, by name and in the order of names, so that the engine's order is always the same.

    Scripted bodies are kept where the engine last needed them; `begin` and `show` around a step make them push
    what they meet, with their true velocity. Without velocity they would push only by sinking in: a cart at 1 m/s by
    20 mm, with it by 0.1 mm. What can be pushed sleeps where it lies until something comes near; see `encounters`.
    Where nothing can be, the engine gets what a robot comes near to; see `presence`.
    """

    def __init__(
        self,
        client: int,
        tick_rate: int,
        triangulate: engine.Triangulate,
        look: int = engine.AS_IT_IS,
        all_present: bool = True,
    ) -> None:
        """The renderer is shown a `look` of the engine's of each; `all_present`: of all, wherever they are."""
        self._client, self._rate, self._triangulate, self._shown_as = client, tick_rate, triangulate, look
        self._all_present = all_present
        self._actors: dict[str, Actor] = {}
        self._absent: DeferredActors | None = None
        self._missing = 0
        self._travelling: list[Actor] = []
        self._driven: list[Actor] = []
        self._fastest = 0.0
        self._pushable: list[Actor] = []
        self._poses: Mapping[str, Pose3] = {}
        self._posed_at: int | None = None
        self._still_since: int | None = None
        self._until_asleep = math.ceil(2 * engine.UNTIL_ASLEEP * tick_rate)
        self._undisturbed: dict[int, int] = {}
        self._meetings = BroadPhase(client, tick_rate, (), ())
        self._moved: list[Actor] = []
        self._about: dict[int, NearbyActors] = {}
        self._ahead = ScheduledPoses((), tick_rate)
        self._homes = RestPoses()

    def add(self, body: Body, tick: int, led: bool = False) -> None:
        """Put a body into the world, maybe one that `follow` will move; one of the same name makes way."""
        self.remove(body.name)
        self._actors[body.name] = self._made(body, tick, led)
        self._let_in(tick)

    def fill(self, bodies: Iterable[Body], tick: int) -> None:
        """Put bodies into the world of whose names none is there."""
        self._actors.update((body.name, self._made(body, tick)) for body in bodies)
        self._let_in(tick)

    def _made(self, body: Body, tick: int, led: bool = False) -> Actor:
        radius, height = radius_and_height(body.solids)
        if body.path is not None and (step := largest_step(body.path, 1 / self._rate, radius)) > MAX_STEP_M:
            raise RunError("invalid", too_fast(body.name, step))
        stays = (SweptSegment(body.pose.x, body.pose.y, body.pose.x, body.pose.y),)
        on, speed = (stays, 0.0) if body.path is None else (swept_segments(body.path), top_speed(body.path, radius))
        hollow = engine.hollow(body.solids, body.mass > 0 and body.path is None)
        surface = engine.fused(body.solids, self._triangulate) if hollow else None
        return Actor(body, body.path, tick, on, speed, math.hypot(radius, height), radius, surface, led)

    def _let_in(self, tick: int) -> None:
        """Let the engine have what may meet anything but a robot, or go anywhere."""
        self._actors = dict(sorted(self._actors.items()))
        actors = self._actors.values()
        everything = self._all_present or any(actor.pushable for actor in actors)
        for actor in actors:
            if actor.number is None and (everything or actor.led):
                self._enter(actor, tick)
        self._sort()

    def _enter(self, actor: Actor, tick: int) -> None:
        """Let the engine have it from now on."""
        client, body, look = self._client, actor.body, self._shown_as
        shape = engine.body_shape(client, body.solids, actor.pushable, self._triangulate)
        if actor.pushable:
            frame = inertia_of_solids(body.solids, body.mass).principal()
            actor.center_from_base = frame[1].inverse()
            actor.number = engine.body(client, body.mass, shape, body.pose, frame, FRICTION, look)
        elif actor.path is None:
            actor.number = engine.fixed(client, shape, look, body.pose, FRICTION)
        else:
            actor.number = engine.body(client, 0.0, shape, body.pose, ((0.0, 0.0, 0.0), Pose3()), FRICTION, look)
        if actor.path is None:
            actor.shown = body.pose
        else:  # to the last bit as if it had been there for long, which where the engine makes it is not
            actor.show(client, actor.at(tick, self._rate))

    @property
    def all_here(self) -> bool:
        """Whether the engine has all of them."""
        return not self._missing

    def meet(self, robots: Iterable[ProximityQuery], tick: int) -> dict[int, str | None]:
        """Let the engine have what any robot may find within its reach: names by numbers of what it had not got."""
        if self._absent is None:
            self._absent = DeferredActors([actor for actor in self._actors.values() if actor.number is None])
        met = self._absent.met(robots)
        for actor in met:
            self._enter(actor, tick)
        if met:
            self._missing -= len(met)
            self._driven = [actor for actor in self._travelling if actor.number is not None]
        return {actor.id: actor.body.name for actor in met}

    def remove(self, name: str) -> None:
        """Take a body out of the world; an unknown name is none."""
        actor = self._actors.pop(name, None)
        if actor is not None:
            if actor.number is not None:
                pybullet.removeBody(actor.number, physicsClientId=self._client)
            self._sort()

    def move(self, name: str, path: MotionPath, tick: int) -> None:
        """Let a body follow a path from `tick` on; from then on nothing can push it."""
        actor = self._actors[name]
        self.add(replace(actor.body, pose=self.poses(tick)[name], mass=0.0, path=path), tick)

    def place(self, name: str, pose: Pose2, tick: int) -> None:
        """Set a body down somewhere else, upright and at rest; no path moves it any more."""
        body = self._actors[name].body
        self.add(replace(body, pose=Pose3.planar(pose, body.pose.z), path=None), tick)

    def motion(self, name: str, tick: int) -> tuple[MotionPath, float] | None:
        """The path that moves a body now, and the seconds since it was set off."""
        actor = self._actors.get(name)
        if actor is None or actor.path is None:
            return None
        since = (tick - actor.since) / self._rate
        return None if actor.path.over(since) else (actor.path, since)

    def mass(self, name: str) -> float:
        """In kg, of what can be pushed; 0 of anything else."""
        actor = self._actors.get(name)
        return actor.body.mass if actor is not None and actor.pushable else 0.0

    def wake(self, name: str) -> None:
        """See to it that a body can be pushed one tick from now: Bullet forgets forces on what it has to wake."""
        if self.mass(name):
            engine.wake(self._client, self._actors[name].id)

    def push(self, name: str, impulse: tuple[float, float]) -> None:
        """Push a body's center of mass during the next tick, in N s; what cannot be pushed, or is gone, is not."""
        if not self.mass(name):
            return
        number = self._actors[name].id
        center = pybullet.getBasePositionAndOrientation(number, physicsClientId=self._client)[0]
        force = (impulse[0] * self._rate, impulse[1] * self._rate, 0.0)
        pybullet.applyExternalForce(number, -1, force, center, pybullet.WORLD_FRAME, physicsClientId=self._client)
        self._still_since = None

    def follow(self, name: str, path: MotionPath, speed: float, tick: int) -> None:
        """Let an upright round body that is led follow another path from `tick` on, nowhere faster than `speed`.

        Where it is now does not change, nor does how fast it may come along: no clearance has to be measured anew.
        """
        actor = self._actors[name]
        actor.follow(path, speed, tick)
        self._ahead = ScheduledPoses(self._travelling, self._rate)
        self._fastest = max(self._fastest, speed)

    def _sort(self) -> None:
        self._posed_at = self._still_since = None
        actors = self._actors.values()
        self._absent, self._missing = None, sum(actor.number is None for actor in actors)
        self._travelling = [actor for actor in actors if actor.path is not None]
        self._driven = [actor for actor in self._travelling if actor.number is not None]
        self._fastest = max((actor.speed for actor in self._travelling), default=0.0)
        self._pushable = [actor for actor in actors if actor.pushable]
        self._meetings = BroadPhase(self._client, self._rate, self._travelling, self._pushable)
        self._about.clear()
        self._ahead = ScheduledPoses(self._travelling, self._rate)
        self._moved = list(self._pushable)
        for actor in self._pushable:
            engine.wake(self._client, actor.id)  # what lay on something that is gone has to fall

    def settling(self) -> RestDetector:
        """Looks at all that can be pushed, for `lay`."""
        return RestDetector(self._client, [actor.id for actor in self._pushable])

    def lay(self, at_rest: Collection[int]) -> None:
        """Let those sleep after the next step that are at rest, by the engine's numbers; others wake what they touch.

        Who has asked where they are has to ask again after that step.
        """
        for number in at_rest:
            engine.lay(self._client, number)
        self._posed_at = None

    def settled(self, tick: int) -> None:
        """It is time to see what lies where it lay when this was called before: there it is at home."""
        poses = self.poses(tick)
        self._homes.look({actor.body.name: poses[actor.body.name] for actor in self._pushable})

    @property
    def homes(self) -> Mapping[str, Pose3]:
        """Where things that can be pushed lay when all had settled, or came to rest later; most lie there for good."""
        return self._homes.poses

    def shaken(self, tick: int) -> None:
        """Something is pushed during the step from `tick` on: how fast things are now says nothing about it."""
        self._meetings.shaken(tick)

    def apart_until(self, tick: int, robots: Callable[[], float]) -> int:
        """The tick until which no scripted body can push anything; -1 where one may push something during this step.

        What one may meet soon is awake from now on. `robots` says how fast any robot may be for a while, in m/s.
        """
        if not (self._travelling and self._pushable):
            return NEVER
        meetings = self._meetings
        if tick >= meetings.until and meetings.look(tick, robots(), self.poses(tick), self._asleep(tick)):
            self._still_since = None
        return -1 if meetings.scripted else meetings.until

    def begin(self, tick: int, everything: bool = True) -> None:
        """Before the step that leads from `tick` to the next: scripted bodies in place and with their velocity.

        Not `everything`: only those that may push something.
        """
        for actor in self._driven if everything else self._meetings.scripted:
            actor.show(self._client, actor.at(tick, self._rate))
            velocity, turning = actor.velocity(tick, self._rate)
            if turning or any(velocity):
                pybullet.resetBaseVelocity(actor.id, velocity, (0.0, 0.0, turning), physicsClientId=self._client)

    def velocities(self, tick: int) -> dict[int, Vector]:
        """How everything moves at `tick` that the engine has, in m/s, by its numbers."""
        moving = {actor.id: actor.velocity(tick, self._rate)[0] for actor in self._driven}
        pushed = {actor.id: pybullet.getBaseVelocity(actor.id, self._client)[0] for actor in self._pushable}
        return {**moving, **pushed}

    def show(self, tick: int, everything: bool = True) -> None:
        """Put the scripted bodies where they are at `tick`, or those that may push something."""
        for actor in self._driven if everything else self._meetings.scripted:
            actor.show(self._client, actor.at(tick, self._rate))

    def poses(self, tick: int) -> Mapping[str, Pose3]:
        """Where everything is, by name in order; the engine is asked at most once for each tick."""
        if self._posed_at == tick:
            return self._poses
        if self._posed_at is None or (self._pushable and not self._asleep(tick)):
            self._poses = {name: self._pose(actor, tick) for name, actor in self._actors.items()}
            self._ahead.forget()
            if self._still_since is None or not all(actor.resting for actor in self._pushable):
                self._still_since = tick
        elif self._travelling:
            predicted = self._ahead.at(tick)
            if predicted is not None:
                self._poses = predicted
            else:
                self._poses = {**self._poses, **{a.body.name: self._pose(a, tick) for a in self._travelling}}
        self._posed_at = tick
        return self._poses

    def look_ahead(self, tick: int, period: int) -> None:
        """`poses` will be asked at `tick`, which is now, and every `period` ticks after it.

        Where scripts have things then is worked out for some seconds at once, as long as nothing comes, goes or is
        pushed.
        """
        if self._travelling and self._posed_at is not None and (not self._pushable or self._asleep(tick)):
            self._ahead.look(tick, period, self._poses)

    def _asleep(self, tick: int) -> bool:
        """Whether all that can be pushed has long been lying, so that the engine lets it lie, and nobody touched it.

        What something only comes near to wakes in the engine and creeps by less than a micrometer until it is touched.
        """
        still = self._still_since is not None and tick - self._still_since > self._until_asleep
        return still and tick <= min(self._undisturbed.values())

    def undisturbed(self, by: int, until: int) -> None:
        """The robot of this number cannot touch any of these until this tick."""
        self._undisturbed[by] = until

    def placed(self, tick: int) -> dict[str, tuple[Body, Pose3]]:
        """Everything and where it is, by name in order."""
        return {name: (self._actors[name].body, pose) for name, pose in self.poses(tick).items()}

    def bodies(self) -> dict[str, Body]:
        """Everything, by name in order."""
        return {name: actor.body for name, actor in self._actors.items()}

    def _pose(self, actor: Actor, tick: int) -> Pose3:
        if actor.path is not None:
            return actor.at(tick, self._rate)
        if not actor.pushable:
            actor.resting = True
            return actor.body.pose
        if actor.ask(self._client) is not None:
            self._moved.append(actor)
        assert actor.placed is not None
        return actor.placed[1]

    def around(self, place: Vector, tick: int) -> str | None:
        """The first thing that a place is inside of, of those that the engine knows as a surface only."""
        for name, pose in self.poses(tick).items():
            surface = self._actors[name].surface
            if surface is not None:
                x, y, z = pose.inverse().apply(np.array(place)).tolist()
                if encloses(surface.vertices[surface.faces], (x, y, z)):
                    return name
        return None

    def lost(self, tick: int) -> str | None:
        """What has become of the first thing that the engine has lost, or None."""
        self.poses(tick)
        moved, self._moved = self._moved, []
        for actor in moved:
            if actor.placed is not None:
                place, turn = actor.placed[0]
                if trouble := divergence_reason(f'object "{actor.body.name}"', *place, sum(turn)):
                    return trouble
        return None

    def within(self, place: Vector, distance: float, level: float, tick: int, by: int) -> list[int]:
        """The engine's numbers of those that may be as near to a place as a distance in meters, for it to be asked.

        Along the ground they need not be farther than `level` to be too far.
        `by` is the number of the robot that asks. A scripted one is put where it is now if that is so near, or where
        the engine has had it until now: nobody is to run into what has gone.
        """
        poses = self.poses(tick)
        asleep = self._still_since if not self._pushable or self._asleep(tick) else None
        about = self._about.get(by)
        if (
            about is None
            or about.asleep != asleep
            or not about.holds(place, distance, tick, self._fastest / self._rate)
        ):
            about = self._about[by] = find_nearby(self._actors.values(), poses, place, distance, tick, asleep)
        return about.near(self._client, place, distance, level, poses)

    def gap(self, place: Vector, distance: float, tick: int, by: int) -> float | None:
        """How much farther than a distance from a place, in meters, `within` would have to look to find anybody.

        None where what is pushed or led may come from anywhere soon. `within` was asked just now.
        """
        about = self._about[by]
        if self._pushable or any(actor.led for actor in self._travelling):
            return None
        return about.gap(place, self.poses(tick), self.come_in(tick - about.tick)) - distance

    def come_in(self, ticks: int) -> float:
        """How far in meters any script moves anything in so many ticks, at most."""
        return self._fastest * ticks / self._rate

    @property
    def loose(self) -> bool:
        """Whether there is anything that can be pushed."""
        return bool(self._pushable)

    def coming(self, tick: int, ticks: int) -> Iterator[tuple[int, Vector, float]]:
        """Of all that can be pushed: number, place, and how far from there any part of it can be so many ticks on."""
        if self._pushable:
            poses, travelled = self.poses(tick), self.top_speed(tick) * ticks / self._rate
            for actor in self._pushable:
                yield actor.id, poses[actor.body.name].position, actor.size + travelled

    def ids(self) -> dict[int, str | None]:
        """Names by the engine's numbers, of those that it has."""
        return {actor.number: name for name, actor in self._actors.items() if actor.number is not None}

    def top_speed(self, tick: int) -> float:
        """How fast anything may come along within a tenth of a second from `tick` on, which is now, in m/s.

        A thing that is hit by a heavier one leaves with up to twice its speed.
        """
        if not self._pushable:
            return self._fastest
        self.poses(tick)
        if self._asleep(tick):
            return max(self._fastest, FALLING) * (2 if len(self._pushable) > 1 else 1)
        speeds = [actor.fastest(self._client) for actor in self._pushable]
        return max(self._fastest, *speeds) * (2 if len(self._pushable) > 1 else 1)
