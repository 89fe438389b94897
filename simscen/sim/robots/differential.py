"""Wheels that drive and skid: differential drives and skid-steered ones."""

from collections.abc import Sequence

import pybullet

from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import Differential, SkidSteer
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.robots.velocity_ramp import VelocityRamp
from simscen.sim.robots.wheeled_base import WheeledBase

ROLLING = 0.1
"""m/s at a wheel's rim up to which it is held where it is when it should stand: more than one step of the firmware."""


class DifferentialDrive:
    """Wheels on the left turn alike, and so do those on the right."""

    def __init__(self, client: int, vehicle: WheeledBase, body: RobotBody, period: float) -> None:
        drive = body.drive
        assert isinstance(drive, Differential | SkidSteer)
        self._client, self._vehicle = client, vehicle
        self._ramp = VelocityRamp(body.limits, period, holonomic=False)
        self._radius = drive.wheel_radius
        scale = drive.turning_scale if isinstance(drive, SkidSteer) else 1.0
        self._half = drive.wheel_separation * scale / 2
        self._left, self._right, self._torques = driven_joints(body, vehicle)
        self._joints = self._left + self._right
        self._still_rolls = False
        self._turn()

    def command(self, twist: Twist) -> None:
        """Drive this from now on; it cannot go sideways."""
        self._ramp.command(twist)

    def advance(self) -> None:
        """Set the wheels' speeds when they change."""
        if self._ramp.advance() or self._still_rolls:
            self._turn()

    def rest(self) -> None:
        """Start again from standstill."""
        self._ramp.rest()
        self._turn()

    def encoders(self) -> tuple[float, ...]:
        """Mean angles in rad of the left and of the right wheels."""
        return mean_angles(self._client, self._vehicle.id, self._joints, len(self._left))

    def _turn(self) -> None:
        vx, _, wz = self._ramp.velocity
        self._still_rolls = vx == wz == 0 and is_rolling(self._client, self._vehicle.id, self._joints, self._radius)
        if vx == wz == 0 and not self._still_rolls:
            hold_wheels(self._client, self._vehicle.id, self._joints, self._torques)
            return
        left, right = (vx - wz * self._half) / self._radius, (vx + wz * self._half) / self._radius
        pybullet.setJointMotorControlArray(
            self._vehicle.id,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[left] * len(self._left) + [right] * len(self._right),
            forces=self._torques,
            physicsClientId=self._client,
        )


def driven_joints(body: RobotBody, vehicle: WheeledBase) -> tuple[list[int], list[int], list[float]]:
    """Joints of the driven wheels on the left and on the right, and the stall torques in N m of both in that order."""
    wheels = [(w, joint) for w, joint in zip(body.wheels, vehicle.joints, strict=True) if w.driven]
    left, right = [pair for pair in wheels if pair[0].left], [pair for pair in wheels if not pair[0].left]
    return [j for _, j in left], [j for _, j in right], [w.torque for w, _ in left + right]


def is_rolling(client: int, robot: int, joints: Sequence[int], radius: float) -> bool:
    """Whether a wheel is too fast to be held where it is: motors too weak for the load still brake it."""
    speeds = (pybullet.getJointState(robot, joint, physicsClientId=client)[1] for joint in joints)
    return any(abs(speed) * radius > ROLLING for speed in speeds)


def hold_wheels(client: int, robot: int, joints: Sequence[int], torques: Sequence[float]) -> None:
    """Keep wheels where they are, as a servo at zero speed does; a velocity of zero alone would creep 0.1 mm/s."""
    angles = [pybullet.getJointState(robot, joint, physicsClientId=client)[0] for joint in joints]
    pybullet.setJointMotorControlArray(
        robot, joints, pybullet.POSITION_CONTROL, targetPositions=angles, forces=torques, physicsClientId=client
    )


def mean_angles(client: int, robot: int, joints: Sequence[int], left: int) -> tuple[float, float]:
    """The mean angles in rad of joints on the left, which are the first so many, and of the others on the right."""
    states = pybullet.getJointStates(robot, joints, client)
    if len(states) == 2:
        return states[0][0], states[1][0]
    angles = [state[0] for state in states]
    return sum(angles[:left]) / left, sum(angles[left:]) / (len(angles) - left)
