"""Differential and skid-steer drives."""

from collections.abc import Sequence

import pybullet

from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import Differential, SkidSteer
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.robots.velocity_ramp import VelocityRamp
from simscen.sim.robots.wheeled_base import WheeledBase

MAX_HOLD_SPEED_M_S = 0.1
"""Rim speed up to which a wheel is held in position when the robot should stand: more than one firmware step."""


class DifferentialDrive:
    """Drive whose wheels on each side turn at the same speed."""

    def __init__(self, client: int, vehicle: WheeledBase, body: RobotBody, period: float) -> None:
        drive = body.drive
        assert isinstance(drive, Differential | SkidSteer)
        self._client, self._vehicle = client, vehicle
        self._ramp = VelocityRamp(body.limits, period, holonomic=False)
        self._radius = drive.wheel_radius
        scale = drive.turning_scale if isinstance(drive, SkidSteer) else 1.0
        self._half_separation = drive.wheel_separation * scale / 2
        self._left, self._right, self._torques = driven_joints(body, vehicle)
        self._joints = self._left + self._right
        self._is_braking = False
        self._set_wheels()

    def command(self, twist: Twist) -> None:
        """Set the velocity to drive from now on; lateral velocity is ignored."""
        self._ramp.command(twist)

    def advance(self) -> None:
        """Update the wheel speeds if they change."""
        if self._ramp.advance() or self._is_braking:
            self._set_wheels()

    def rest(self) -> None:
        """Reset the velocity to zero."""
        self._ramp.rest()
        self._set_wheels()

    def encoders(self) -> tuple[float, ...]:
        """Return the mean angles in rad of the left and of the right wheels."""
        return mean_angles(self._client, self._vehicle.id, self._joints, len(self._left))

    def _set_wheels(self) -> None:
        vx, _, wz = self._ramp.velocity
        self._is_braking = vx == wz == 0 and is_rolling(self._client, self._vehicle.id, self._joints, self._radius)
        if vx == wz == 0 and not self._is_braking:
            hold_wheels(self._client, self._vehicle.id, self._joints, self._torques)
            return
        left, right = (vx - wz * self._half_separation) / self._radius, (vx + wz * self._half_separation) / self._radius
        pybullet.setJointMotorControlArray(
            self._vehicle.id,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[left] * len(self._left) + [right] * len(self._right),
            forces=self._torques,
            physicsClientId=self._client,
        )


def driven_joints(body: RobotBody, vehicle: WheeledBase) -> tuple[list[int], list[int], list[float]]:
    """Return the joints of the left and of the right driven wheels, and all stall torques in N m in that order."""
    wheels = [(w, joint) for w, joint in zip(body.wheels, vehicle.joints, strict=True) if w.driven]
    left, right = [pair for pair in wheels if pair[0].left], [pair for pair in wheels if not pair[0].left]
    return [j for _, j in left], [j for _, j in right], [w.torque for w, _ in left + right]


def is_rolling(client: int, robot: int, joints: Sequence[int], radius: float) -> bool:
    """Return whether a wheel is too fast to be held in position, because weak motors are still braking it."""
    speeds = (pybullet.getJointState(robot, joint, physicsClientId=client)[1] for joint in joints)
    return any(abs(speed) * radius > MAX_HOLD_SPEED_M_S for speed in speeds)


def hold_wheels(client: int, robot: int, joints: Sequence[int], torques: Sequence[float]) -> None:
    """Hold the wheel angles with position control; velocity control at zero would creep by 0.1 mm/s."""
    angles = [pybullet.getJointState(robot, joint, physicsClientId=client)[0] for joint in joints]
    pybullet.setJointMotorControlArray(
        robot, joints, pybullet.POSITION_CONTROL, targetPositions=angles, forces=torques, physicsClientId=client
    )


def mean_angles(client: int, robot: int, joints: Sequence[int], left_count: int) -> tuple[float, float]:
    """Return the mean angles in rad of the first `left_count` joints and of the others."""
    states = pybullet.getJointStates(robot, joints, client)
    if len(states) == 2:
        return states[0][0], states[1][0]
    angles = [state[0] for state in states]
    return sum(angles[:left_count]) / left_count, sum(angles[left_count:]) / (len(angles) - left_count)
