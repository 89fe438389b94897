"""Omnidirectional and mecanum drives on a planar base: a hull on three joints with a motor for each direction."""

import math
from collections.abc import Callable, Mapping

import numpy as np

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.kinematics import STOP, MecanumWheels, Twist
from simscen.model.robot import Mecanum
from simscen.sim.body.inertia import combine
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import collision_shapes, engine, pybullet
from simscen.sim.robots.robot_state import RobotState
from simscen.sim.robots.velocity_ramp import VelocityRamp

MAX_FORCE_PER_WEIGHT = 0.7
"""Largest motor force divided by the weight of the robot."""
IDENTITY_QUATERNION = (0.0, 0.0, 0.0, 1.0)
CARRIER_COUNT = 2
"""Number of links without a shape between the world and the hull: one for each of the joints along x and y."""
CARRIER_MASS_KG = 0.001
"""Mass of each carrier, and of each link of the hull except the first, because the engine requires a mass."""


class PlanarBase:
    """Hull on three joints from the world: along x, along y, and about z. It stays at z = 0 and cannot tip."""

    def __init__(self, client: int, body: RobotBody, pose: Pose2, visual_shape: int) -> None:
        """Place the base at `pose`; the renderer shows `visual_shape`."""
        self._client = client
        wheels = [wheel.inertia.transformed(Pose3(wheel.x, wheel.y, wheel.radius)) for wheel in body.wheels]
        total = combine([body.chassis, *wheels]) if wheels else body.chassis
        moments, base_from_center = total.principal()
        hull_shapes = collision_shapes.create_robot_shapes(client, body.collision_solids)
        extra_count = len(hull_shapes) - 1
        self.id: int = pybullet.createMultiBody(
            0,
            linkMasses=[CARRIER_MASS_KG] * CARRIER_COUNT + [body.mass] + [CARRIER_MASS_KG] * extra_count,
            linkCollisionShapeIndices=[-1] * CARRIER_COUNT + hull_shapes,
            linkVisualShapeIndices=[-1] * CARRIER_COUNT + [visual_shape] * len(hull_shapes),
            linkPositions=[(0, 0, 0)] * (CARRIER_COUNT + len(hull_shapes)),
            linkOrientations=[IDENTITY_QUATERNION] * (CARRIER_COUNT + len(hull_shapes)),
            linkInertialFramePositions=[(0, 0, 0)] * CARRIER_COUNT
            + [base_from_center.position]
            + [(0, 0, 0)] * extra_count,
            linkInertialFrameOrientations=[IDENTITY_QUATERNION] * CARRIER_COUNT
            + [base_from_center.quaternion]
            + [IDENTITY_QUATERNION] * extra_count,
            linkParentIndices=[0, 1, 2] + [3] * extra_count,
            linkJointTypes=[pybullet.JOINT_PRISMATIC] * CARRIER_COUNT
            + [pybullet.JOINT_REVOLUTE]
            + [pybullet.JOINT_FIXED] * extra_count,
            linkJointAxis=[(1, 0, 0), (0, 1, 0), (0, 0, 1)] + [(0, 0, 1)] * extra_count,
            physicsClientId=client,
        )
        self.joints = (0, 1, 2)
        self.hull_links = tuple(range(2, 2 + len(hull_shapes)))
        self.ground_links: Mapping[int, float] = {}
        """Always empty, because the base does not touch the ground."""
        pybullet.changeDynamics(self.id, 2, localInertiaDiagonal=moments, physicsClientId=client)
        for link in range(2 + len(hull_shapes)):
            pybullet.changeDynamics(
                self.id, link, lateralFriction=body.hull_friction, restitution=0.0, linearDamping=0, angularDamping=0,
                jointDamping=0, physicsClientId=client,
            )  # fmt: skip
        for link in self.hull_links:
            pybullet.setCollisionFilterGroupMask(self.id, link, engine.HULL, ~engine.GROUND, physicsClientId=client)
        self._mass, self._floor_friction, self._motor_ratio = body.mass, 1.0, body.motor_ratio
        self._target_velocity = STOP
        self._radius = body.circumscribed_radius
        self.place(pose)

    def place(self, pose: Pose2) -> None:
        """Place the base at rest."""
        for joint, value in zip(self.joints, pose, strict=True):
            pybullet.resetJointState(self.id, joint, value, 0.0, physicsClientId=self._client)

    def state(self) -> RobotState:
        """Query the current state from the engine."""
        states = pybullet.getJointStates(self.id, self.joints, physicsClientId=self._client)
        (x, vx, *_), (y, vy, *_), (yaw, wz, *_) = states
        return RobotState(Pose3.planar(Pose2(x, y, yaw)), (vx, vy, 0.0), (0.0, 0.0, wz))

    def pose(self) -> Pose2:
        """Return the pose. The heading is not wrapped: it is 2π larger after a full turn."""
        states = pybullet.getJointStates(self.id, self.joints, physicsClientId=self._client)
        return Pose2(*(state[0] for state in states))

    def push(self, impulse: tuple[float, float], seconds: float) -> None:
        """Apply an impulse (N s, world frame) at the center of mass during the next step, which takes `seconds`."""
        center = pybullet.getLinkState(self.id, 2, physicsClientId=self._client)[0]
        force = (impulse[0] / seconds, impulse[1] / seconds, 0.0)
        pybullet.applyExternalForce(self.id, 2, force, center, pybullet.WORLD_FRAME, physicsClientId=self._client)

    def set_friction(self, friction: Callable[[float, float], float]) -> None:
        """Limit the motor force by the friction coefficient that `friction` returns at the base's (x, y)."""
        x, y, _ = self.pose()
        if (value := friction(x, y)) != self._floor_friction:
            self._floor_friction = value
            self.set_motors(self._target_velocity)

    def set_motors(self, velocity: Twist) -> None:
        """Set the target velocity of the motors along the world axes, and their largest force."""
        self._target_velocity = velocity
        max_force = min(MAX_FORCE_PER_WEIGHT * self._motor_ratio, self._floor_friction) * self._mass * GRAVITY_M_S2
        pybullet.setJointMotorControlArray(
            self.id,
            self.joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=velocity,
            forces=(max_force, max_force, max_force * self._radius),
            physicsClientId=self._client,
        )


class OmnidirectionalDrive:
    """Drive that follows any twist. Its encoders measure the motion of the base over the ground, in the base frame."""

    def __init__(self, base: PlanarBase, body: RobotBody, period: float) -> None:
        """Take the base that the drive moves. `period` is the time in s between two calls of `advance`."""
        self._base, self._period = base, period
        self._ramp = VelocityRamp(body.limits, period, is_holonomic=True)
        self._traveled = (0.0, 0.0, 0.0)
        self._last_pose = base.pose()
        base.set_motors(STOP)

    def command(self, twist: Twist) -> None:
        """Set the commanded velocity in the base frame."""
        self._ramp.command(twist)

    def advance(self) -> None:
        """Run one period of the firmware: update the motor velocity towards the command."""
        changed = self._ramp.advance()
        velocity = self._actual_velocity(self._ramp.velocity)
        if not changed and velocity == STOP:
            return
        self._update_encoders()
        heading = self._last_pose.yaw + velocity.wz * self._period / 2
        c, s = math.cos(heading), math.sin(heading)
        self._base.set_motors(Twist(c * velocity.vx - s * velocity.vy, s * velocity.vx + c * velocity.vy, velocity.wz))

    def _actual_velocity(self, velocity: Twist) -> Twist:
        """Return the velocity in the base frame that results from a commanded velocity."""
        return velocity

    def rest(self) -> None:
        """Reset the velocity to zero."""
        self._ramp.rest()
        self._last_pose = self._base.pose()
        self._base.set_motors(STOP)

    def encoders(self) -> tuple[float, ...]:
        """Return the accumulated motion: forward (m), left (m), and turn (rad)."""
        self._update_encoders()
        return self._traveled

    def _update_encoders(self) -> None:
        """Add the motion since the last update, which is assumed to be an arc (logarithm in SE(2))."""
        pose = self._base.pose()
        step, turn = self._last_pose.between(pose), wrap(pose.yaw - self._last_pose.yaw)
        self._last_pose = pose
        half = turn / 2
        scale = half / math.tan(half) if abs(half) > 1e-9 else 1.0
        forward, left = scale * step.x + half * step.y, scale * step.y - half * step.x
        x, y, yaw = self._traveled
        self._traveled = x + forward, y + left, yaw + turn


class MecanumDrive(OmnidirectionalDrive):
    """Drive with four mecanum wheels that never slip.

    The firmware uses the wheel dimensions in the drive's specification. The actual wheels of a URDF can differ.
    """

    def __init__(self, base: PlanarBase, body: RobotBody, period: float) -> None:
        assert isinstance(body.drive, Mecanum)
        self._specified_wheels, self._wheels = body.drive.wheels, _actual_wheels(body)
        super().__init__(base, body, period)

    def encoders(self) -> tuple[float, ...]:
        """Return the angles in rad of the front left, front right, rear left, and rear right wheel."""
        return self._wheels.speeds(Twist(*super().encoders()))

    def _actual_velocity(self, velocity: Twist) -> Twist:
        return self._wheels.motion(self._specified_wheels.speeds(velocity))


def _actual_wheels(body: RobotBody) -> MecanumWheels:
    """Return mecanum wheels with the mean dimensions of the body's wheels."""
    assert isinstance(body.drive, Mecanum)
    return MecanumWheels(
        radius=float(np.mean([wheel.radius for wheel in body.wheels])),
        half_track=float(np.mean([abs(wheel.y) for wheel in body.wheels])),
        half_base=float(np.mean([abs(wheel.x) for wheel in body.wheels])),
        slant=body.drive.wheels.slant,
    )
