"""Things that move: by a script, or because they are pushed."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pybullet

from simscen.core.geometry import Pose3, wrap
from simscen.core.shapes import Body, Mesh, MotionPath
from simscen.sim import engine
from simscen.sim.enclosure import winds_around
from simscen.sim.inertia import GRAVITY, of_solids
from simscen.sim.lost import lost
from simscen.sim.motion_path import pose_at, top_speed
from simscen.sim.outline import reach

FRICTION = 0.6
"""Of pushable things on the ground: about that of wood or cardboard on concrete."""
Vector = tuple[float, float, float]
JUMP = 50.0
"""A script that asks for more m/s than this sets its body down elsewhere, rather than hurl it through the world."""


@dataclass
class Actor:
    """A body in the engine: `shown` is where the engine has it, `path` began at tick `since`.

    `speed` is the fastest that any part of it ever moves along its path, in m/s, `size` how far from its origin it
    extends, in metres. Where the engine has it as a surface without an inside, `surface` is that, in the body's frame.
    """

    id: int
    body: Body
    centre_from_base: Pose3
    shown: Pose3
    path: MotionPath | None
    since: int
    speed: float
    size: float
    surface: Mesh | None

    @property
    def pushable(self) -> bool:
        """Whether the engine moves it, rather than a script or nothing."""
        return self.body.mass > 0 and self.path is None


class Actors:
    """All that moves but the robot, by name and in the order of names, so that the engine's order is always the same.

    Scripted bodies are kept where the engine last needed them; `begin` and `finish` around a step make them push
    what they meet, with their true velocity. Without velocity they would push only by sinking in: a cart at 1 m/s by
    20 mm, with it by 0.1 mm.
    """

    def __init__(self, client: int, tick_rate: int, triangulate: engine.Triangulate) -> None:
        self._client, self._rate, self._triangulate = client, tick_rate, triangulate
        self._actors: dict[str, Actor] = {}
        self._travelling: list[Actor] = []
        self.pushing = False
        """Whether scripted bodies might push pushable ones."""

    def add(self, body: Body, tick: int) -> None:
        """Put a body into the world; one of the same name makes way."""
        self.remove(body.name)
        pushable = body.mass > 0 and body.path is None
        frame = of_solids(body.solids, body.mass).principal() if pushable else ((0.0, 0.0, 0.0), Pose3())
        number = engine.body(
            self._client,
            body.mass if pushable else 0.0,
            (
                engine.body_shape(self._client, body.solids, pushable, self._triangulate),
                engine.body_visual(self._client, body.solids, self._triangulate),
            ),
            body.pose,
            frame,
            FRICTION,
        )
        radius, height = reach(body.solids)
        speed = 0.0 if body.path is None else top_speed(body.path, radius)
        surface = engine.fused(body.solids, self._triangulate) if engine.hollow(body.solids, pushable) else None
        centre = frame[1].inverse()
        self._actors[body.name] = Actor(number, body, centre, body.pose, body.path, tick, speed,
                                         math.hypot(radius, height), surface)  # fmt: skip
        self._sort()

    def remove(self, name: str) -> None:
        """Take a body out of the world; an unknown name is none."""
        actor = self._actors.pop(name, None)
        if actor is not None:
            pybullet.removeBody(actor.id, physicsClientId=self._client)
            self._sort()

    def move(self, name: str, path: MotionPath, tick: int) -> None:
        """Let a body follow a path from `tick` on; from then on nothing can push it."""
        actor = self._actors[name]
        self.add(replace(actor.body, pose=self._pose(actor, tick), mass=0.0, path=path), tick)

    def _sort(self) -> None:
        self._actors = dict(sorted(self._actors.items()))
        self._travelling = [actor for actor in self._actors.values() if actor.path is not None]
        self.pushing = bool(self._travelling) and any(actor.pushable for actor in self._actors.values())

    def begin(self, tick: int) -> None:
        """Before the step that leads from `tick` to the next: scripted bodies in place and with their velocity."""
        self.show(tick)
        for actor in self._travelling:
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

    def show(self, tick: int) -> None:
        """Put the scripted bodies where they are at `tick`."""
        for actor in self._travelling:
            pose = self._pose(actor, tick)
            if pose != actor.shown:
                actor.shown = pose
                pybullet.resetBasePositionAndOrientation(
                    actor.id, pose.position, pose.quaternion, physicsClientId=self._client
                )

    def poses(self, tick: int) -> dict[str, Pose3]:
        """Where everything is, by name in order."""
        return {name: self._pose(actor, tick) for name, actor in self._actors.items()}

    def placed(self, tick: int) -> dict[str, tuple[Body, Pose3]]:
        """Everything and where it is, by name in order."""
        return {name: (actor.body, self._pose(actor, tick)) for name, actor in self._actors.items()}

    def _pose(self, actor: Actor, tick: int) -> Pose3:
        if actor.path is not None:
            return Pose3.planar(pose_at(actor.path, (tick - actor.since) / self._rate), actor.body.pose.z)
        if not actor.pushable:
            return actor.body.pose
        position, turn = pybullet.getBasePositionAndOrientation(actor.id, physicsClientId=self._client)
        return Pose3(*position, *turn).compose(actor.centre_from_base)

    def around(self, place: Vector, tick: int) -> str | None:
        """The first thing that a place is inside of, of those that the engine knows as a surface only."""
        for name, actor in self._actors.items():
            if actor.surface is not None:
                x, y, z = self._pose(actor, tick).inverse().apply(np.array(place)).tolist()
                if winds_around(actor.surface.vertices[actor.surface.faces], (x, y, z)):
                    return name
        return None

    def lost(self) -> str | None:
        """What has become of the first thing that the engine has lost, or None."""
        for name, actor in self._actors.items():
            if actor.pushable:
                place, turn = pybullet.getBasePositionAndOrientation(actor.id, physicsClientId=self._client)
                if trouble := lost(f'object "{name}"', *place, *turn):
                    return trouble
        return None

    def ids(self) -> dict[int, str | None]:
        """Names by the engine's numbers."""
        return {actor.id: name for name, actor in self._actors.items()}

    def top_speed(self) -> float:
        """How fast anything may come along within a tenth of a second, in m/s.

        A thing that is hit by a heavier one leaves with up to twice its speed.
        """
        speeds = [self._speed(actor) for actor in self._actors.values()]
        several = sum(actor.pushable for actor in self._actors.values()) > 1
        return max(speeds, default=0.0) * (2 if several else 1)

    def _speed(self, actor: Actor) -> float:
        if not actor.pushable:
            return actor.speed
        linear, angular = pybullet.getBaseVelocity(actor.id, physicsClientId=self._client)
        # What it may gain by falling for 0.1 s.
        return math.hypot(*linear) + math.hypot(*angular) * actor.size + 0.1 * GRAVITY
