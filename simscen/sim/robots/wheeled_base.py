"""Wheeled base of a robot: a PyBullet multibody with the hull as its base and the wheels as links."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Pose2, Pose3, Vector, rotate_vector
from simscen.core.geometry.shapes import Solid, Sphere
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.body.undercarriage import Wheel, caster_gap, casters_for_uneven_ground
from simscen.sim.bullet import collision_shapes, engine, pybullet
from simscen.sim.robots.robot_state import RobotState
from simscen.sim.scene.terrain import MIN_NORMAL_Z_CASTER, MIN_NORMAL_Z_WHEEL, Terrain

IDENTITY_QUATERNION = (0.0, 0.0, 0.0, 1.0)
_new = tuple.__new__
"""Creates a named tuple without the call overhead of its class."""
KNUCKLE_MASS_RATIO = 0.2
"""Mass of a steering knuckle divided by the mass of its wheel."""
PIN_RADIUS_M = 0.001
"""Radius of the pin, a small sphere on the axle of a fast wheel (see `_wheel_shape`)."""
ROLL_MARGIN_FACTOR = 1.1
"""Factor by which a wheel may roll farther in a step than the robot's velocity limits allow."""
HULL_LINK_MASS_KG = 0.001
"""Mass of each link of the hull except the base, which has the mass of the chassis."""


class WheeledBase:
    """Hull with wheels and casters, for all drives except omnidirectional and mecanum.

    Wheels are spheres that touch only the ground. Hull and casters collide with obstacles. Casters have no friction.
    """

    def __init__(
        self,
        client: int,
        body: RobotBody,
        pose: Pose2,
        terrain: Terrain | None = None,
        tick_seconds: float = 0.0,
        visual_shape: int = engine.DEFAULT_VISUAL,
    ) -> None:
        """Place the base at `pose`. `terrain` is the uneven ground (None: flat ground).

        `tick_seconds` is the duration of a physics step (0: the robot never drives). `visual_shape` is the id of the
        shape that the renderer shows.
        """
        self._client, self._terrain = client, terrain
        moments, self._base_from_center = body.chassis.principal()  # center: frame of the principal axes
        self._center = self._base_from_center.position
        self._center_from_base = self._base_from_center.inverse()
        self._is_aligned = self._center_from_base.quaternion == IDENTITY_QUATERNION
        """Whether the principal axes of inertia are parallel to the axes of the base frame."""
        casters = casters_for_uneven_ground(body.casters) if terrain else body.casters
        self.id, self.joints, self.hull_links = _create_multibody(client, body, casters, tick_seconds, visual_shape)
        on_ground = [(caster.pose.x, caster.pose.y) for caster in body.casters if not caster_gap(caster)]
        self._supports = np.array([*((wheel.x, wheel.y) for wheel in body.wheels), *on_ground])
        """Points (n, 2) in the base frame at which wheels and casters touch flat ground."""
        pybullet.changeDynamics(self.id, -1, localInertiaDiagonal=moments, physicsClientId=client)
        self._wheels: dict[int, Vector] = {}
        """Positions of the wheels in the base frame on the ground, by link."""
        for wheel, joint in zip(body.wheels, self.joints, strict=True):
            link = joint + 1 if wheel.is_steered else joint
            self._wheels[link] = (wheel.x, wheel.y, 0.0)
            self._set_up_wheel(wheel, link)
        self.ground_links = dict.fromkeys(self._wheels, MIN_NORMAL_Z_WHEEL)
        """For each link of a wheel or caster, the smallest z of a contact normal that means standing on the ground."""
        if casters:
            self.ground_links[self.hull_links[-1]] = MIN_NORMAL_Z_CASTER
        self._frictions = dict.fromkeys(self._wheels, 1.0)
        self.place(pose)

    def _set_up_wheel(self, wheel: Wheel, link: int) -> None:
        """Set the collision filter, the friction, and the inertia of a wheel."""
        xx, yy, zz = wheel.inertia.tensor.diagonal().tolist()  # the axle is the y axis
        # The sphere extends beyond the sides of a narrow wheel; against obstacles, the wheel guard in the hull is used.
        pybullet.setCollisionFilterGroupMask(
            self.id, link, engine.WHEEL, engine.GROUND | engine.TERRAIN, physicsClientId=self._client
        )
        pybullet.changeDynamics(
            self.id, link, lateralFriction=1.0, restitution=0.0, linearDamping=0, angularDamping=0, jointDamping=0,
            localInertiaDiagonal=(xx, yy + wheel.rotor_inertia, zz), physicsClientId=self._client,
        )  # fmt: skip

    def place(self, pose: Pose2) -> None:
        """Place the base at rest on the ground."""
        base = self._terrain.standing_pose(pose, self._supports) if self._terrain else Pose3.planar(pose)
        center = base.compose(self._base_from_center)
        pybullet.resetBasePositionAndOrientation(
            self.id, center.position, center.quaternion, physicsClientId=self._client
        )
        pybullet.resetBaseVelocity(self.id, (0, 0, 0), (0, 0, 0), physicsClientId=self._client)
        for joint in range(pybullet.getNumJoints(self.id, physicsClientId=self._client)):
            angle = pybullet.getJointState(self.id, joint, physicsClientId=self._client)[0]
            pybullet.resetJointState(self.id, joint, angle, 0.0, physicsClientId=self._client)

    def state(self) -> RobotState:
        """Query the current state from the engine."""
        (px, py, pz), quaternion = pybullet.getBasePositionAndOrientation(self.id, self._client)
        (vx, vy, vz), angular = pybullet.getBaseVelocity(self.id, self._client)
        if self._is_aligned:
            x, y, z = rotate_vector(quaternion, self._center)
            pose = _new(Pose3, (px - x, py - y, pz - z, *quaternion))
        else:
            pose = Pose3(px, py, pz, *quaternion).compose(self._center_from_base)
            x, y, z = rotate_vector(pose.quaternion, self._center)
        wx, wy, wz = angular
        linear = (vx - (wy * z - wz * y), vy - (wz * x - wx * z), vz - (wx * y - wy * x))
        return _new(RobotState, (pose, linear, angular))

    def set_friction(self, friction: Callable[[float, float], float]) -> None:
        """Set the friction of each wheel to the value that `friction` returns at the wheel's (x, y)."""
        base = self.state().pose
        for link, position in self._wheels.items():
            x, y, _ = rotate_vector(base.quaternion, position)
            value = friction(base.x + x, base.y + y)
            if value != self._frictions[link]:
                self._frictions[link] = value
                pybullet.changeDynamics(self.id, link, lateralFriction=value, physicsClientId=self._client)

    def push(self, impulse: tuple[float, float], seconds: float) -> None:
        """Apply an impulse (N s, world frame) at the center of mass during the next step, which takes `seconds`."""
        center = pybullet.getBasePositionAndOrientation(self.id, physicsClientId=self._client)[0]
        force = (impulse[0] / seconds, impulse[1] / seconds, 0.0)
        pybullet.applyExternalForce(self.id, -1, force, center, pybullet.WORLD_FRAME, physicsClientId=self._client)


def _create_multibody(
    client: int, body: RobotBody, casters: Sequence[Solid], tick_seconds: float, visual_shape: int
) -> tuple[int, tuple[int, ...], tuple[int, ...]]:
    """Create the multibody; return its id, the first joint of each wheel, and the links of the hull and casters.

    The first joint of a steered wheel is its steering joint. The casters, if any, are the last link.
    """
    links: list[_Link] = []
    joints: list[int] = []
    for wheel in body.wheels:
        joints.append(len(links))
        max_roll = tick_seconds * (body.limits.linear + body.limits.angular * abs(wheel.y))
        links += _wheel_links(client, wheel, len(links), max_roll)
    hull_shapes = collision_shapes.create_robot_shapes(client, body.hull)
    first, *others = [*hull_shapes, *collision_shapes.create_robot_shapes(client, casters)]
    hull = (-1, *range(len(links), len(links) + len(others)))
    links += [_Link(HULL_LINK_MASS_KG, shape, (0.0, 0.0, 0.0), 0, pybullet.JOINT_FIXED, (0, 0, 1)) for shape in others]
    _, center = body.chassis.principal()
    robot: int = pybullet.createMultiBody(
        body.chassis.mass,
        first,
        visual_shape,
        baseInertialFramePosition=center.position,
        baseInertialFrameOrientation=center.quaternion,
        linkMasses=[link.mass for link in links],
        linkCollisionShapeIndices=[link.shape for link in links],
        linkVisualShapeIndices=[visual_shape] * len(links),
        linkPositions=[link.position for link in links],
        linkOrientations=[IDENTITY_QUATERNION] * len(links),
        linkInertialFramePositions=[(0, 0, 0)] * len(links),
        linkInertialFrameOrientations=[IDENTITY_QUATERNION] * len(links),
        linkParentIndices=[link.parent for link in links],
        linkJointTypes=[link.joint for link in links],
        linkJointAxis=[link.axis for link in links],
        physicsClientId=client,
    )
    for index, link in enumerate(hull):
        friction = body.hull_friction if index < len(hull_shapes) else 0.0  # the last link may be that of the casters
        pybullet.setCollisionFilterGroupMask(robot, link, engine.HULL, ~engine.WHEEL, physicsClientId=client)
        pybullet.changeDynamics(
            robot, link, lateralFriction=friction, restitution=0.0, linearDamping=0, angularDamping=0,
            physicsClientId=client,
        )  # fmt: skip
    return robot, tuple(joints), hull


class _Link(NamedTuple):
    """Link for PyBullet's createMultiBody.

    mass:      mass in kg
    shape:     id of the collision shape; -1 without shape
    position:  position in m of the link in the frame of its parent
    parent:    0 for the base, k + 1 for the link with the index k
    joint:     PyBullet's type of the joint to the parent
    axis:      axis of the joint in the frame of the link
    """

    mass: float
    shape: int
    position: Vector
    parent: int
    joint: int
    axis: tuple[int, int, int]


def _wheel_links(client: int, wheel: Wheel, index: int, max_roll: float) -> list[_Link]:
    """Return the link of a wheel; for a steered wheel, first its knuckle. `index` is the index of the first link."""
    shape, position = _wheel_shape(client, wheel, max_roll), (wheel.x, wheel.y, wheel.radius)
    if not wheel.is_steered:
        return [_Link(wheel.inertia.mass, shape, position, 0, pybullet.JOINT_REVOLUTE, (0, 1, 0))]
    return [
        _Link(KNUCKLE_MASS_RATIO * wheel.inertia.mass, -1, position, 0, pybullet.JOINT_REVOLUTE, (0, 0, 1)),
        _Link(wheel.inertia.mass, shape, (0.0, 0.0, 0.0), index + 1, pybullet.JOINT_REVOLUTE, (0, 1, 0)),
    ]


def _wheel_shape(client: int, wheel: Wheel, max_roll: float) -> int:
    """Create a sphere as the contact shape of a wheel that rolls at most `max_roll` m in one step.

    For a fast wheel, adds a tiny second sphere on the axle, a pin. The pin enlarges the extent of the shape, so that
    Bullet discards outdated contact points (see CONTACT_BREAKING_RATIO).
    """
    pin_distance = min(
        ROLL_MARGIN_FACTOR * max_roll / engine.CONTACT_BREAKING_RATIO, 2 * abs(wheel.y) + wheel.radius / 2
    )
    if pin_distance <= wheel.radius:
        shape: int = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=wheel.radius, physicsClientId=client)
        return shape
    pin = Solid(Sphere(PIN_RADIUS_M), Pose3(y=-math.copysign(pin_distance, wheel.y)))
    return collision_shapes.create_compound_shape(client, [Solid(Sphere(wheel.radius)), pin])
