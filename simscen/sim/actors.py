"""Things that move: by a script, or because they are pushed."""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np
import pybullet

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.motion_path import Track, top_speed
from simscen.core.shapes import Body, MotionPath
from simscen.sim import engine
from simscen.sim.actor import About, Actor, Placing, Vector
from simscen.sim.ahead import Ahead
from simscen.sim.enclosure import winds_around
from simscen.sim.encounters import HORIZON, Balls, encounters
from simscen.sim.homes import Homes
from simscen.sim.inertia import GRAVITY, of_solids
from simscen.sim.lost import lost
from simscen.sim.outline import reach
from simscen.sim.settled import Settling

FRICTION = 0.6
"""Of pushable things on the ground: about that of wood or cardboard on concrete."""
FALLING = 0.1 * GRAVITY
"""m/s that what rests may gain within a tenth of a second."""
NEVER = 2**62
"""A tick that never comes."""
ABOUT = 2.0
"""m farther than was asked for within which things are looked for, so that the others need not be looked at soon."""
JUMP = 50.0
"""A script that asks for more m/s than this sets its body down elsewhere, rather than hurl it through the world."""


class Actors:
    """All that moves but the robots, by name and in the order of names, so that the engine's order is always the same.

    Scripted bodies are kept where the engine last needed them; `begin` and `show` around a step make them push
    what they meet, with their true velocity. Without velocity they would push only by sinking in: a cart at 1 m/s by
    20 mm, with it by 0.1 mm. What can be pushed sleeps where it lies until something comes near; see `encounters`.
    """

    def __init__(
        self, client: int, tick_rate: int, triangulate: engine.Triangulate, look: int = engine.AS_IT_IS
    ) -> None:
        """The renderer is shown a `look` of the engine's of each."""
        self._client, self._rate, self._triangulate, self._shown_as = client, tick_rate, triangulate, look
        self._actors: dict[str, Actor] = {}
        self._travelling: list[Actor] = []
        self._fastest = 0.0
        self._pushable: list[Actor] = []
        self._poses: Mapping[str, Pose3] = {}
        self._posed_at: int | None = None
        self._still_since: int | None = None
        self._until_asleep = math.ceil(2 * engine.UNTIL_ASLEEP * tick_rate)
        self._undisturbed: dict[int, int] = {}
        self._looked_until = -1
        self._meeting: list[Actor] = []
        self._shaken_at = -1
        self._lying: Balls | None = None
        self._moved: list[Actor] = []
        self._about: dict[int, About] = {}
        self._ahead = Ahead((), tick_rate)
        self._homes = Homes()

    def add(self, body: Body, tick: int) -> None:
        """Put a body into the world; one of the same name makes way."""
        self.remove(body.name)
        self.fill([body], tick)

    def fill(self, bodies: Iterable[Body], tick: int) -> None:
        """Put bodies into the world, in this order, of whose names none is there."""
        for body in bodies:
            self._actors[body.name] = self._made(body, tick)
        self._sort()

    def _made(self, body: Body, tick: int) -> Actor:
        pushable = body.mass > 0 and body.path is None
        frame = of_solids(body.solids, body.mass).principal() if pushable else ((0.0, 0.0, 0.0), Pose3())
        number = engine.body(
            self._client,
            body.mass if pushable else 0.0,
            engine.body_shape(self._client, body.solids, pushable, self._triangulate),
            body.pose,
            frame,
            FRICTION,
            self._shown_as,
        )
        radius, height = reach(body.solids)
        speed = 0.0 if body.path is None else top_speed(body.path, radius)
        surface = engine.fused(body.solids, self._triangulate) if engine.hollow(body.solids, pushable) else None
        centre = frame[1].inverse()
        return Actor(
            number, body, centre, body.pose, body.path, tick, speed, math.hypot(radius, height), radius, surface
        )

    def remove(self, name: str) -> None:
        """Take a body out of the world; an unknown name is none."""
        actor = self._actors.pop(name, None)
        if actor is not None:
            pybullet.removeBody(actor.id, physicsClientId=self._client)
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
        """Push a body's centre of mass during the next tick, in N s; what cannot be pushed, or is gone, is not."""
        if not self.mass(name):
            return
        number = self._actors[name].id
        centre = pybullet.getBasePositionAndOrientation(number, physicsClientId=self._client)[0]
        force = (impulse[0] * self._rate, impulse[1] * self._rate, 0.0)
        pybullet.applyExternalForce(number, -1, force, centre, pybullet.WORLD_FRAME, physicsClientId=self._client)
        self._still_since = None

    def follow(self, name: str, path: MotionPath, speed: float, tick: int) -> None:
        """Let an upright round body that follows a path follow another from `tick` on, nowhere faster than `speed`.

        Where it is now does not change, nor does how fast it may come along: no clearance has to be measured anew.
        """
        actor = self._actors[name]
        actor.path, actor.since, actor.speed = path, tick, speed
        actor.led, actor.track = True, None
        actor.scripted.clear()
        self._ahead = Ahead(self._travelling, self._rate)
        self._fastest = max(self._fastest, speed)

    def _sort(self) -> None:
        self._posed_at = self._still_since = None
        self._actors = dict(sorted(self._actors.items()))
        self._travelling = [actor for actor in self._actors.values() if actor.path is not None]
        self._fastest = max((actor.speed for actor in self._travelling), default=0.0)
        self._pushable = [actor for actor in self._actors.values() if actor.pushable]
        self._looked_until, self._meeting, self._lying = -1, [], None
        self._about.clear()
        self._ahead = Ahead(self._travelling, self._rate)
        self._moved = list(self._pushable)
        for actor in self._pushable:
            engine.wake(self._client, actor.id)  # what lay on something that is gone has to fall

    def settling(self) -> Settling:
        """Looks at all that can be pushed, for `lay`."""
        return Settling(self._client, [actor.id for actor in self._pushable])

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
        self._looked_until, self._shaken_at = -1, tick

    def apart_until(self, tick: int, robots: Callable[[], float]) -> int:
        """The tick until which no scripted body can push anything; -1 where one may push something during this step.

        What one may meet soon is awake from now on. `robots` says how fast any robot may be for a while, in m/s.
        """
        if not (self._travelling and self._pushable):
            return NEVER
        if tick >= self._looked_until:
            self._look(tick, robots())
        return -1 if self._meeting else self._looked_until

    def _look(self, tick: int, robots: float) -> None:
        """See who may meet; all are put where they are, for until the next look nobody may run into what has gone."""
        poses, moving = self.poses(tick), list[Actor]()
        for actor in self._travelling:
            self._show(actor, poses[actor.body.name])
            if not actor.parked((tick - actor.since) / self._rate, HORIZON):
                moving.append(actor)
        if self._lying is None or not self._asleep(tick):
            self._lying = Balls.of((poses[a.body.name][:3], a.size, self._speed(a)) for a in self._pushable)
        scripted = Balls.of((poses[a.body.name][:3], a.radius, a.speed) for a in moving)  # upright, all of them
        # What is hit by something heavier leaves with up to twice its speed.
        found = encounters(scripted, self._lying, 2 * max(robots, self._fastest, float(self._lying.speeds.max())))
        self._meeting = [moving[number] for number in found.scripted]
        for number in found.pushable:
            engine.wake(self._client, self._pushable[number].id)
            self._still_since = None
        self._looked_until = tick + (1 if tick == self._shaken_at else max(1, math.floor(found.seconds * self._rate)))

    def begin(self, tick: int, everything: bool = True) -> None:
        """Before the step that leads from `tick` to the next: scripted bodies in place and with their velocity.

        Not `everything`: only those that may push something.
        """
        for actor in self._travelling if everything else self._meeting:
            self._show(actor, self._pose(actor, tick))
            velocity, turning = self._scripted(actor, tick)
            if turning or any(velocity):
                pybullet.resetBaseVelocity(actor.id, velocity, (0.0, 0.0, turning), physicsClientId=self._client)

    def _scripted(self, actor: Actor, tick: int) -> tuple[Vector, float]:
        """The velocity in m/s and rad/s that leads along the path to the next tick."""
        here, there = self._pose(actor, tick), self._pose(actor, tick + 1)
        vx, vy = (there.x - here.x) * self._rate, (there.y - here.y) * self._rate
        if math.hypot(vx, vy) > JUMP:
            return (0.0, 0.0, 0.0), 0.0
        return (vx, vy, 0.0), wrap(there.yaw - here.yaw) * self._rate

    def velocities(self, tick: int) -> dict[int, Vector]:
        """How everything moves at `tick`, in m/s, by the engine's numbers."""
        return {
            actor.id: pybullet.getBaseVelocity(actor.id, physicsClientId=self._client)[0]
            if actor.path is None
            else self._scripted(actor, tick)[0]
            for actor in self._actors.values()
        }

    def show(self, tick: int, everything: bool = True) -> None:
        """Put the scripted bodies where they are at `tick`, or those that may push something."""
        for actor in self._travelling if everything else self._meeting:
            self._show(actor, self._pose(actor, tick))

    def _show(self, actor: Actor, pose: Pose3) -> None:
        if pose != actor.shown:
            actor.shown = pose
            pybullet.resetBasePositionAndOrientation(actor.id, pose[:3], pose[3:], self._client)

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
            foreseen = self._ahead.at(tick)
            if foreseen is not None:
                self._poses = foreseen
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

    def _track(self, actor: Actor) -> Track:
        if actor.track is None:
            assert actor.path is not None
            actor.track = Track(actor.path, actor.body.pose.z)
        return actor.track

    def _asleep(self, tick: int) -> bool:
        """Whether all that can be pushed has long been lying, so that the engine lets it lie, and nobody touched it.

        What something only comes near to wakes in the engine and creeps by less than a micrometre until it is touched.
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
            there = actor.scripted.get(tick)
            if there is None:
                if len(actor.scripted) > 1:
                    actor.scripted.clear()
                actor.scripted[tick] = there = self._track(actor).at((tick - actor.since) / self._rate)
            return there
        if not actor.body.mass > 0:
            actor.resting = True
            return actor.body.pose
        said: Placing = pybullet.getBasePositionAndOrientation(actor.id, self._client)
        actor.resting = actor.placed is not None and actor.placed[0] == said
        if actor.placed is None or not actor.resting:
            actor.placed = said, Pose3(*said[0], *said[1]).compose(actor.centre_from_base)
            self._moved.append(actor)
        return actor.placed[1]

    def around(self, place: Vector, tick: int) -> str | None:
        """The first thing that a place is inside of, of those that the engine knows as a surface only."""
        for name, pose in self.poses(tick).items():
            surface = self._actors[name].surface
            if surface is not None:
                x, y, z = pose.inverse().apply(np.array(place)).tolist()
                if winds_around(surface.vertices[surface.faces], (x, y, z)):
                    return name
        return None

    def lost(self, tick: int) -> str | None:
        """What has become of the first thing that the engine has lost, or None."""
        self.poses(tick)
        moved, self._moved = self._moved, []
        for actor in moved:
            if actor.placed is not None:
                place, turn = actor.placed[0]
                if trouble := lost(f'object "{actor.body.name}"', *place, sum(turn)):
                    return trouble
        return None

    def within(self, place: Vector, distance: float, tick: int, by: int) -> list[int]:
        """The engine's numbers of those that may be as near to a place as a distance in metres, for it to be asked.

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
            about = self._about[by] = self._look_about(place, distance + ABOUT, tick, asleep)
        if about.lying is not None:
            return [number for number, there, size in about.lying if math.dist(there, place) <= distance + size]
        near = list[int]()
        for actor in about.actors:
            pose, reach = poses[actor.body.name], distance + actor.size
            is_near = math.dist(pose[:3], place) <= reach
            if actor.path is not None and (is_near or math.dist(actor.shown[:3], place) <= reach):
                self._show(actor, pose)
            if is_near:
                near.append(actor.id)
        return near

    def gap(self, place: Vector, distance: float, tick: int, by: int) -> float | None:
        """How much farther than a distance from a place, in metres, `within` would have to look to find anybody.

        None where what is pushed or led may come from anywhere soon. `within` was asked just now.
        """
        about, poses = self._about[by], self.poses(tick)
        if self._pushable or any(actor.led for actor in self._travelling):
            return None
        gap = about.distance - math.dist(place, about.place) - self.come_in(tick - about.tick)
        for actor in about.actors:
            away = min(math.dist(poses[actor.body.name][:3], place), math.dist(actor.shown[:3], place))
            gap = min(gap, away - actor.size)
        return gap - distance

    def come_in(self, ticks: int) -> float:
        """How far in metres any script moves anything in so many ticks, at most."""
        return self._fastest * ticks / self._rate

    def _look_about(self, place: Vector, distance: float, tick: int, asleep: int | None) -> About:
        poses = self.poses(tick)
        actors = tuple(
            actor
            for name, actor in self._actors.items()
            if (asleep is None and actor.pushable)
            or min(math.dist(poses[name][:3], place), math.dist(actor.shown[:3], place)) <= distance + actor.size
        )
        lying = None
        if not any(actor.path is not None or (asleep is None and actor.pushable) for actor in actors):
            lying = tuple((actor.id, poses[actor.body.name].position, actor.size) for actor in actors)
        return About(actors, place, distance, tick, asleep, lying)

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
        """Names by the engine's numbers."""
        return {actor.id: name for name, actor in self._actors.items()}

    def top_speed(self, tick: int) -> float:
        """How fast anything may come along within a tenth of a second from `tick` on, which is now, in m/s.

        A thing that is hit by a heavier one leaves with up to twice its speed.
        """
        if not self._pushable:
            return self._fastest
        self.poses(tick)
        if self._asleep(tick):
            return max(self._fastest, FALLING) * (2 if len(self._pushable) > 1 else 1)
        return max(self._fastest, *map(self._speed, self._pushable)) * (2 if len(self._pushable) > 1 else 1)

    def _speed(self, actor: Actor) -> float:
        if actor.resting:
            return FALLING
        linear, angular = pybullet.getBaseVelocity(actor.id, physicsClientId=self._client)
        return math.hypot(*linear) + math.hypot(*angular) * actor.size + FALLING
