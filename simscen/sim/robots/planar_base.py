"""A base that moves in any direction, idealised as a motor for each direction."""

import math
from collections.abc import Callable, Mapping

import numpy as np
import pybullet

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.kinematics import STOP, MecanumWheels, Twist
from simscen.model.robot import Mecanum
from simscen.sim.body.inertia import GRAVITY, MassProperties, combine
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import engine
from simscen.sim.robots.robot_state import RobotState
from simscen.sim.robots.velocity_ramp import VelocityRamp

GRIP = 0.7
"""Most force of the motors over the robot's weight."""
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
SLED = 0.001
"""Mass in kg of the two carriers between the world and the hull; the engine wants one."""


class PlanarBase:
    """A hull on three joints from the world: along x, along y, about z. It cannot tip, and no wheel slips.

    It stays at z = 0: a ramp is a wall to it, and a sill that its hull clears nothing at all.
    """

    rolling: Mapping[int, float]

    def __init__(self, client: int, body: RobotBody, pose: Pose2, look: int = engine.AS_IT_IS) -> None:
        """Set down at `pose`; the renderer is shown a `look` of the engine's."""
        self._client = client
        moments, base_from_center = _whole(body).principal()
        sleds = 2
        hulls = engine.hull_shapes(client, body.solid)
        extra = len(hulls) - 1
        self.id: int = pybullet.createMultiBody(
            0,
            linkMasses=[SLED] * sleds + [body.mass] + [SLED] * extra,
            linkCollisionShapeIndices=[-1] * sleds + hulls,
            linkVisualShapeIndices=[-1] * sleds + [look] * len(hulls),
            linkPositions=[(0, 0, 0)] * (sleds + len(hulls)),
            linkOrientations=[UPRIGHT] * (sleds + len(hulls)),
            linkInertialFramePositions=[(0, 0, 0)] * sleds + [base_from_center.position] + [(0, 0, 0)] * extra,
            linkInertialFrameOrientations=[UPRIGHT] * sleds + [base_from_center.quaternion] + [UPRIGHT] * extra,
            linkParentIndices=[0, 1, 2] + [3] * extra,
            linkJointTypes=[pybullet.JOINT_PRISMATIC] * sleds
            + [pybullet.JOINT_REVOLUTE]
            + [pybullet.JOINT_FIXED] * extra,
            linkJointAxis=[(1, 0, 0), (0, 1, 0), (0, 0, 1)] + [(0, 0, 1)] * extra,
            physicsClientId=client,
        )
        self.joints = (0, 1, 2)
        self.hull_links = tuple(range(2, 2 + len(hulls)))
        self.rolling = {}
        pybullet.changeDynamics(self.id, 2, localInertiaDiagonal=moments, physicsClientId=client)
        for link in range(2 + len(hulls)):
            pybullet.changeDynamics(
                self.id, link, lateralFriction=0.0, restitution=0.0, linearDamping=0, angularDamping=0, jointDamping=0,
                physicsClientId=client,
            )  # fmt: skip
        for link in self.hull_links:
            engine.touch(client, self.id, link, engine.HULL, ~engine.GROUND)
        self._mass, self._held, self._power = body.mass, 1.0, body.power
        self._radius = body.circumscribed_radius
        self.place(pose)

    def place(self, pose: Pose2) -> None:
        """Set it down at rest."""
        for joint, value in zip(self.joints, pose, strict=True):
            pybullet.resetJointState(self.id, joint, value, 0.0, physicsClientId=self._client)

    def state(self) -> RobotState:
        """Where it is and how it moves now."""
        states = pybullet.getJointStates(self.id, self.joints, physicsClientId=self._client)
        (x, vx, *_), (y, vy, *_), (yaw, wz, *_) = states
        return RobotState(Pose3.planar(Pose2(x, y, yaw)), (vx, vy, 0.0), (0.0, 0.0, wz))

    def plane(self) -> Pose2:
        """Where it is; the heading counts full turns."""
        states = pybullet.getJointStates(self.id, self.joints, physicsClientId=self._client)
        return Pose2(*(state[0] for state in states))

    def push(self, impulse: tuple[float, float], seconds: float) -> None:
        """Push its center of mass during the next step, which lasts `seconds`."""
        place = pybullet.getLinkState(self.id, 2, physicsClientId=self._client)[0]
        force = (impulse[0] / seconds, impulse[1] / seconds, 0.0)
        pybullet.applyExternalForce(self.id, 2, force, place, pybullet.WORLD_FRAME, physicsClientId=self._client)

    def hold(self, friction: Callable[[float, float], float]) -> None:
        """Its motors have no more force than the floor below its middle holds."""
        x, y, _ = self.plane()
        self._held = friction(x, y)

    def motors(self, velocity: Twist) -> None:
        """Run the motors: a velocity along the world's axes, with no more force than wheels have grip."""
        grip = min(GRIP * self._power, self._held) * self._mass * GRAVITY
        pybullet.setJointMotorControlArray(
            self.id,
            self.joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=velocity,
            forces=(grip, grip, grip * self._radius),
            physicsClientId=self._client,
        )


def _whole(body: RobotBody) -> MassProperties:
    """The chassis with its wheels, if it has any: they do not move in it."""
    wheels = [wheel.inertia.placed(Pose3(wheel.x, wheel.y, wheel.radius)) for wheel in body.wheels]
    return combine([body.chassis, *wheels]) if wheels else body.chassis


class OmnidirectionalDrive:
    """Follows any twist; its encoders see every motion over the ground, in the base frame."""

    def __init__(self, base: PlanarBase, body: RobotBody, period: float) -> None:
        self._base, self._period = base, period
        self._ramp = VelocityRamp(body.limits, period, holonomic=True)
        self._rolled = (0.0, 0.0, 0.0)
        self._seen = base.plane()
        base.motors(STOP)

    def command(self, twist: Twist) -> None:
        """Drive this from now on."""
        self._ramp.command(twist)

    def advance(self) -> None:
        """Turn the motors' velocity with the base, half a period ahead, so that it drives arcs."""
        changed = self._ramp.advance()
        velocity = self._driven(self._ramp.velocity)
        if not changed and velocity == STOP:
            return
        self._count()
        heading = self._seen.yaw + velocity.wz * self._period / 2
        c, s = math.cos(heading), math.sin(heading)
        self._base.motors(Twist(c * velocity.vx - s * velocity.vy, s * velocity.vx + c * velocity.vy, velocity.wz))

    def _driven(self, velocity: Twist) -> Twist:
        """What the motors make of a velocity."""
        return velocity

    def rest(self) -> None:
        """Start again from standstill."""
        self._ramp.rest()
        self._seen = self._base.plane()
        self._base.motors(STOP)

    def encoders(self) -> tuple[float, ...]:
        """Meters forward, meters to the left and radians so far."""
        self._count()
        return self._rolled

    def _count(self) -> None:
        """Add the motion since last counted, as the constant twist that leads there (the logarithm in SE(2))."""
        now = self._base.plane()
        step, turn = self._seen.between(now), wrap(now.yaw - self._seen.yaw)
        self._seen = now
        half = turn / 2
        scale = half / math.tan(half) if abs(half) > 1e-9 else 1.0
        forward, left = scale * step.x + half * step.y, scale * step.y - half * step.x
        self._rolled = (self._rolled[0] + forward, self._rolled[1] + left, self._rolled[2] + turn)


# Four mecanum wheels under a planar base: the wheels roll without slip, the rollers without friction.
class MecanumDrive(OmnidirectionalDrive):
    """Firmware that reckons with the drive's dimensions, on wheels that are where the body has them."""

    def __init__(self, base: PlanarBase, body: RobotBody, period: float) -> None:
        assert isinstance(body.drive, Mecanum)
        self._firmware, self._wheels = body.drive.wheels, wheels_of(body)
        super().__init__(base, body, period)

    def encoders(self) -> tuple[float, ...]:
        """Angles in rad of the wheels front left, front right, rear left, rear right."""
        return self._wheels.speeds(Twist(*super().encoders()))

    def _driven(self, velocity: Twist) -> Twist:
        return self._wheels.motion(self._firmware.speeds(velocity))


def wheels_of(body: RobotBody) -> MecanumWheels:
    """Wheels with their dimensions as built; a URDF's need not be those of the drive."""
    assert isinstance(body.drive, Mecanum)
    return MecanumWheels(
        radius=float(np.mean([wheel.radius for wheel in body.wheels])),
        half_track=float(np.mean([abs(wheel.y) for wheel in body.wheels])),
        half_base=float(np.mean([abs(wheel.x) for wheel in body.wheels])),
        slant=body.drive.wheels.slant,
    )
