"""A robot in the engine: its hull as base, its wheels as links, and where its base frame is."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pybullet

from simscen.core.geometry import Pose2, Pose3, Vector, rotated
from simscen.core.geometry.shapes import Solid, Sphere
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.body.undercarriage import Wheel, caster_gap, compliant_casters
from simscen.sim.bullet import engine
from simscen.sim.robots.robot_state import RobotState
from simscen.sim.scene.terrain import ON_CASTERS, ON_WHEELS, Terrain

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
_made = tuple.__new__  # a state without the calls of its class
KNUCKLE = 0.2
"""Mass of a steering knuckle over that of its wheel."""
PIN = 0.001
"""Radius in m of what widens a wheel's extent."""
SPARE = 1.1
"""How much farther than its limits say a wheel may roll in a step."""
HULL_PIECE = 0.001
"""Mass in kg of a piece of the hull that the engine needs as a link; the chassis holds the true mass."""


class WheeledBase:
    """A robot on wheels, resting on the ground.

    A wheel touches the ground as a ball of its radius: one point of contact in the wheel's middle plane, so that the
    radius and the separation in the datasheet are those of the contact, and half the time of a cylinder's contact. A
    pin along its axle keeps it at one point however fast it rolls; see `_ball`.
    Only the hull touches obstacles. On uneven ground the casters are a link of their own, so that one that stands on a
    ramp can be told from a hull that scrapes it.
    """

    def __init__(
        self,
        client: int,
        body: RobotBody,
        pose: Pose2,
        terrain: Terrain | None = None,
        tick: float = 0.0,
        look: int = engine.AS_IT_IS,
    ) -> None:
        """Set down at `pose`; one step of the engine lasts `tick` seconds, 0 where nothing will ever drive it.

        The renderer is shown a `look` of the engine's.
        """
        self._client, self._terrain = client, terrain
        moments, self._base_from_center = body.chassis.principal()
        self._center = self._base_from_center.position
        self._center_from_base = self._base_from_center.inverse()
        self._level = self._center_from_base.quaternion == UPRIGHT
        casters = compliant_casters(body.casters) if terrain else ()
        self.id, self.joints, self.hull_links = _build(client, body, casters, tick, look)
        self.rolling: Mapping[int, float] = _rolling(body, self.joints, self.hull_links, casters)
        standing = [(caster.pose.x, caster.pose.y) for caster in body.casters if not caster_gap(caster)]
        self._feet = np.array([*((wheel.x, wheel.y) for wheel in body.wheels), *standing])
        pybullet.changeDynamics(self.id, -1, localInertiaDiagonal=moments, physicsClientId=client)
        for wheel, joint in zip(body.wheels, self.joints, strict=True):
            self._set_up(wheel, joint)
        self._wheels: dict[int, Vector] = {
            joint + 1 if wheel.steered else joint: (wheel.x, wheel.y, 0.0)
            for wheel, joint in zip(body.wheels, self.joints, strict=True)
        }
        self._grip = dict.fromkeys(self._wheels, 1.0)
        self.place(pose)

    def _set_up(self, wheel: Wheel, joint: int) -> None:
        xx, yy, zz = wheel.inertia.tensor.diagonal().tolist()  # a wheel turns about y and is round
        link = joint + 1 if wheel.steered else joint
        # The ball reaches out beyond a narrow wheel's sides: its guard in the hull stands for it there.
        engine.touch(self._client, self.id, link, engine.WHEEL, engine.GROUND | engine.TERRAIN)
        pybullet.changeDynamics(
            self.id,
            link,
            lateralFriction=1.0,
            restitution=0.0,
            linearDamping=0,
            angularDamping=0,
            jointDamping=0,
            localInertiaDiagonal=(xx, yy + wheel.rotor, zz),
            physicsClientId=self._client,
        )

    def place(self, pose: Pose2) -> None:
        """Set it down at rest, its base frame on the ground."""
        base = self._terrain.seat(pose, self._feet) if self._terrain else Pose3.planar(pose)
        center = base.compose(self._base_from_center)
        pybullet.resetBasePositionAndOrientation(
            self.id, center.position, center.quaternion, physicsClientId=self._client
        )
        pybullet.resetBaseVelocity(self.id, (0, 0, 0), (0, 0, 0), physicsClientId=self._client)
        for joint in range(pybullet.getNumJoints(self.id, physicsClientId=self._client)):
            angle = pybullet.getJointState(self.id, joint, physicsClientId=self._client)[0]
            pybullet.resetJointState(self.id, joint, angle, 0.0, physicsClientId=self._client)

    def state(self) -> RobotState:
        """Where it is and how it moves now."""
        (px, py, pz), turn = pybullet.getBasePositionAndOrientation(self.id, self._client)
        (vx, vy, vz), angular = pybullet.getBaseVelocity(self.id, self._client)
        if self._level:
            x, y, z = rotated(turn, self._center)
            pose = _made(Pose3, (px - x, py - y, pz - z, *turn))
        else:
            pose = Pose3(px, py, pz, *turn).compose(self._center_from_base)
            x, y, z = rotated(pose.quaternion, self._center)
        wx, wy, wz = angular
        return _made(
            RobotState, (pose, (vx - (wy * z - wz * y), vy - (wz * x - wx * z), vz - (wx * y - wy * x)), angular)
        )

    def hold(self, friction: Callable[[float, float], float]) -> None:
        """Give each wheel the friction of the floor below it."""
        base = self.state().pose
        for link, place in self._wheels.items():
            x, y, _ = rotated(base.quaternion, place)
            found = friction(base.x + x, base.y + y)
            if found != self._grip[link]:
                self._grip[link] = found
                pybullet.changeDynamics(self.id, link, lateralFriction=found, physicsClientId=self._client)

    def push(self, impulse: tuple[float, float], seconds: float) -> None:
        """Push its center of mass during the next step, which lasts `seconds`."""
        center = pybullet.getBasePositionAndOrientation(self.id, physicsClientId=self._client)[0]
        force = (impulse[0] / seconds, impulse[1] / seconds, 0.0)
        pybullet.applyExternalForce(self.id, -1, force, center, pybullet.WORLD_FRAME, physicsClientId=self._client)


def _rolling(body: RobotBody, joints: Sequence[int], hull: Sequence[int], casters: Sequence[Solid]) -> dict[int, float]:
    """The links of wheels, and of casters that are a link of their own, which is the hull's last."""
    wheels = [joint + 1 if wheel.steered else joint for wheel, joint in zip(body.wheels, joints, strict=True)]
    return dict.fromkeys(wheels, ON_WHEELS) | ({hull[-1]: ON_CASTERS} if casters else {})


def _build(
    client: int, body: RobotBody, casters: Sequence[Solid], tick: float, look: int
) -> tuple[int, tuple[int, ...], tuple[int, ...]]:
    """The multibody; for each wheel its first joint, steering before rolling; and the links of the hull.

    `casters` become the hull's last link; without any, those of the body are part of its first.
    """
    links: list[_Link] = []
    joints: list[int] = []
    for wheel in body.wheels:
        joints.append(len(links))
        rolled = tick * (body.limits.linear + body.limits.angular * abs(wheel.y))
        links += _links(client, wheel, len(links), rolled)
    shapes = (
        [*engine.hull_shapes(client, body.hull), *engine.hull_shapes(client, casters)]
        if casters
        else (engine.hull_shapes(client, body.solid))
    )
    first, *others = shapes
    hull = (-1, *range(len(links), len(links) + len(others)))
    links += [_Link(HULL_PIECE, shape, (0.0, 0.0, 0.0), 0, pybullet.JOINT_FIXED, (0, 0, 1)) for shape in others]
    _, center = body.chassis.principal()
    robot: int = pybullet.createMultiBody(
        body.chassis.mass,
        first,
        look,
        baseInertialFramePosition=center.position,
        baseInertialFrameOrientation=center.quaternion,
        linkMasses=[link.mass for link in links],
        linkCollisionShapeIndices=[link.shape for link in links],
        linkVisualShapeIndices=[look] * len(links),
        linkPositions=[link.place for link in links],
        linkOrientations=[UPRIGHT] * len(links),
        linkInertialFramePositions=[(0, 0, 0)] * len(links),
        linkInertialFrameOrientations=[UPRIGHT] * len(links),
        linkParentIndices=[link.parent for link in links],
        linkJointTypes=[link.joint for link in links],
        linkJointAxis=[link.axis for link in links],
        physicsClientId=client,
    )
    for link in hull:
        engine.touch(client, robot, link, engine.HULL, ~engine.WHEEL)
        pybullet.changeDynamics(
            robot, link, lateralFriction=0.0, restitution=0.0, linearDamping=0, angularDamping=0,
            physicsClientId=client,
        )  # fmt: skip
    return robot, tuple(joints), hull


class _Link(NamedTuple):
    """A link as createMultiBody wants it; parent 0 is the base, k + 1 is link k."""

    mass: float
    shape: int
    place: Vector
    parent: int
    joint: int
    axis: tuple[int, int, int]


def _links(client: int, wheel: Wheel, number: int, rolled: float) -> list[_Link]:
    ball, place = _ball(client, wheel, rolled), (wheel.x, wheel.y, wheel.radius)
    if not wheel.steered:
        return [_Link(wheel.inertia.mass, ball, place, 0, pybullet.JOINT_REVOLUTE, (0, 1, 0))]
    return [
        _Link(KNUCKLE * wheel.inertia.mass, -1, place, 0, pybullet.JOINT_REVOLUTE, (0, 0, 1)),
        _Link(wheel.inertia.mass, ball, (0.0, 0.0, 0.0), number + 1, pybullet.JOINT_REVOLUTE, (0, 1, 0)),
    ]


def _ball(client: int, wheel: Wheel, rolled: float) -> int:
    """A wheel that rolls at most so many meters in one step.

    Bullet takes a contact for the one of the step before if it is no farther from it on the wheel than a share of the
    shape's extent, and otherwise keeps both: a bare ball that rolls by more than 2 % of its radius in a step trails up
    to three points behind that carry nothing and double what a step costs. A pin along the axle, at whose height
    nothing touches it, makes the extent large enough; it ends within the ball on the other side.
    """
    reach = min(SPARE * rolled / engine.BREAKING, 2 * abs(wheel.y) + wheel.radius / 2)
    if reach <= wheel.radius:
        shape: int = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=wheel.radius, physicsClientId=client)
        return shape
    pin = Solid(Sphere(PIN), Pose3(y=-math.copysign(reach, wheel.y)))
    return engine.compound_shape(client, [Solid(Sphere(wheel.radius)), pin])
