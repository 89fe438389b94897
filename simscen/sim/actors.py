"""Things that move: by a script, or because they are pushed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import pybullet

from simscen.core.geometry import Pose3
from simscen.core.shapes import Body, Mesh, MotionPath, Solid
from simscen.sim import engine
from simscen.sim.inertia import of_solids
from simscen.sim.motion_path import pose_at, top_speed


@dataclass
class Actor:
    """A body in the engine. `path` began at tick `since`; `scripted` bodies push, and cannot be pushed."""

    id: int
    body: Body
    centre_from_base: Pose3
    pose: Pose3
    path: MotionPath | None
    since: int

    @property
    def scripted(self) -> bool:
        """Whether nothing but the scenario moves it."""
        return self.path is not None or self.body.mass == 0


class Actors:
    """All that moves but the robot, by name, in the order of names so that the engine's order is always the same."""

    def __init__(self, client: int, tick_rate: int, triangulate: engine.Triangulate) -> None:
        self._client, self._rate, self._triangulate = client, tick_rate, triangulate
        self._actors: dict[str, Actor] = {}
        self._travelling: list[Actor] = []

    def add(self, body: Body, tick: int) -> None:
        """Put a body into the world; one of the same name makes way."""
        self.remove(body.name)
        kinematic = body.mass == 0 or body.path is not None
        shape = _shape(self._client, body, kinematic, self._triangulate)
        moments, base_from_centre = of_solids(body.solids, body.mass).principal()
        if kinematic:
            moments, base_from_centre = (0.0, 0.0, 0.0), Pose3()
        number: int = pybullet.createMultiBody(
            0.0 if kinematic else body.mass, shape, -1, body.pose.position, body.pose.quaternion,
            baseInertialFramePosition=base_from_centre.position,
            baseInertialFrameOrientation=base_from_centre.quaternion, physicsClientId=self._client,
        )  # fmt: skip
        pybullet.changeDynamics(
            number, -1, lateralFriction=FRICTION, restitution=0.0, linearDamping=0.0, angularDamping=0.0,
            physicsClientId=self._client,
        )  # fmt: skip
        if not kinematic:
            pybullet.changeDynamics(number, -1, localInertiaDiagonal=moments, physicsClientId=self._client)
        self._actors[body.name] = Actor(number, body, base_from_centre.inverse(), body.pose, None, tick)
        if body.path is not None:
            self.move(body.name, body.path, tick)

    def remove(self, name: str) -> None:
        """Take a body out of the world; an unknown name is none."""
        actor = self._actors.pop(name, None)
        if actor is not None:
            pybullet.removeBody(actor.id, physicsClientId=self._client)
            self._travelling = [other for other in self._travelling if other is not actor]

    def move(self, name: str, path: MotionPath, tick: int) -> None:
        """Let a body follow a path from `tick` on; from then on nothing can push it."""
        actor = self._actors[name]
        if not actor.scripted:
            actor = self._fixed_to_script(actor, tick)
        actor.path, actor.since = path, tick
        self._travelling = [a for _, a in sorted(self._actors.items()) if a.path is not None]

    def advance(self, tick: int) -> None:
        """Move the scripted bodies so that the step to `tick` takes them along their paths."""
        for actor in self._travelling:
            self._advance(actor, tick)

    def _advance(self, actor: Actor, tick: int) -> None:
        assert actor.path is not None
        seconds = (tick - actor.since) / self._rate
        goal = Pose3.planar(pose_at(actor.path, seconds), actor.body.pose.z)
        if goal == actor.pose:
            return
        actor.pose = goal
        pybullet.resetBasePositionAndOrientation(actor.id, goal.position, goal.quaternion, physicsClientId=self._client)

    def _fixed_to_script(self, actor: Actor, tick: int) -> Actor:
        from dataclasses import replace

        body = replace(actor.body, pose=self._pose(actor), mass=0.0)
        self.add(body, tick)
        return self._actors[body.name]

    @property
    def travelling(self) -> bool:
        """Whether anything follows a script."""
        return bool(self._travelling)

    def poses(self) -> dict[str, Pose3]:
        """Where everything is, by name in order."""
        return {name: self._pose(actor) for name, actor in sorted(self._actors.items())}

    def placed(self) -> dict[str, tuple[Body, Pose3]]:
        """Everything and where it is, by name in order."""
        return {name: (actor.body, self._pose(actor)) for name, actor in sorted(self._actors.items())}

    def _pose(self, actor: Actor) -> Pose3:
        if actor.scripted:
            return actor.pose
        position, turn = pybullet.getBasePositionAndOrientation(actor.id, physicsClientId=self._client)
        return Pose3(*position, *turn).compose(actor.centre_from_base)

    def ids(self) -> Mapping[int, str]:
        """Names by the engine's numbers."""
        return {actor.id: name for name, actor in sorted(self._actors.items())}

    def top_speed(self) -> float:
        """How fast anything may come along within a tenth of a second, in m/s."""
        return max((self._speed(actor) for actor in self._actors.values()), default=0.0)

    def _speed(self, actor: Actor) -> float:
        if actor.path is not None:
            return top_speed(actor.path)
        if actor.body.mass == 0:
            return 0.0
        linear, angular = pybullet.getBaseVelocity(actor.id, physicsClientId=self._client)
        # What it may gain by falling for 0.1 s.
        return math.hypot(*linear) + math.hypot(*angular) + 0.1 * engine.GRAVITY


FRICTION = 0.6
"""Of pushable things on the ground: wood or cardboard on concrete (Engineering ToolBox, friction coefficients)."""


def _shape(client: int, body: Body, kinematic: bool, triangulate: engine.Triangulate) -> int:
    if all(engine.primitive(solid.shape) for solid in body.solids):
        return engine.compound_shape(client, body.solids)
    if not kinematic:
        return engine.hull_shape(client, body.solids)  # Bullet moves convex shapes only
    return engine.concave_shape(client, _fused(body.solids, triangulate))


def _fused(solids: tuple[Solid, ...], triangulate: engine.Triangulate) -> Mesh:
    import numpy as np

    meshes = [(triangulate(solid.shape), solid.pose) for solid in solids]
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh, _ in meshes)])
    return Mesh(
        np.concatenate([pose.apply(mesh.vertices) for mesh, pose in meshes]),
        np.concatenate([mesh.faces + np.int32(start) for (mesh, _), start in zip(meshes, starts, strict=False)]),
    )
