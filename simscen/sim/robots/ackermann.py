"""Ackermann drive: two driven rear wheels and two steered front wheels."""

import math

import pybullet

from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import Ackermann
from simscen.sim.body.inertia import GRAVITY
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.robots.differential import driven_joints, hold_wheels, is_rolling, mean_angles
from simscen.sim.robots.velocity_ramp import VelocityRamp
from simscen.sim.robots.wheeled_base import WheeledBase

STEERING_RATE_RAD_S = 3.2
"""Steering rate of the servo of an F1TENTH car (f1tenth_gym, sv_max; O'Kelly et al. 2020)."""
MIN_STEERING_SPEED_M_S = 0.01
"""Commanded speed below which the curvature is undefined; the steering angle then remains."""


class AckermannDrive:
    """Inverse of the bicycle model: curvature = turn rate / speed, tan(steering) = wheel base * curvature.

    Both front wheels turn around the same point on the line of the rear axle (Ackermann condition; Siegwart et al.,
    Autonomous Mobile Robots, section 3.3). The drive cannot turn in place.
    """

    def __init__(self, client: int, vehicle: WheeledBase, body: RobotBody, period: float) -> None:
        assert isinstance(body.drive, Ackermann)
        self._client, self._robot, self._drive = client, vehicle.id, body.drive
        self._ramp = VelocityRamp(body.limits, period, holonomic=False)
        self._max_steering_step = STEERING_RATE_RAD_S * period
        self._steering = 0.0
        wheels = list(zip(body.wheels, vehicle.joints, strict=True))
        self._left, self._right, self._torques = driven_joints(body, vehicle)
        # Left before right, like the angles in _set_steering.
        self._knuckles = [joint for wheel, joint in sorted(wheels, key=lambda w: -w[0].y) if wheel.steered]
        self._servo_torque = 0.5 * body.mass * GRAVITY * body.drive.wheel_radius
        # The front wheels roll freely.
        rolling = [joint + 1 for joint in self._knuckles]
        pybullet.setJointMotorControlArray(
            self._robot, rolling, pybullet.VELOCITY_CONTROL, forces=[0.0] * len(rolling), physicsClientId=client
        )
        self._is_braking = False
        self._set_steering()
        self._set_wheels()

    def command(self, twist: Twist) -> None:
        """Set the velocity to drive from now on."""
        self._ramp.command(twist)

    def advance(self) -> None:
        """Steer and accelerate towards the command."""
        steering = self._target_steering()
        if steering != self._steering:
            max_step = self._max_steering_step
            self._steering += max(-max_step, min(max_step, steering - self._steering))
            self._set_steering()
            self._ramp.advance()
            self._set_wheels()
        elif self._ramp.advance() or self._is_braking:
            self._set_wheels()

    def _target_steering(self) -> float:
        target, limit = self._ramp.target, self._drive.max_steering
        if abs(target.vx) < MIN_STEERING_SPEED_M_S:
            return self._steering
        return max(-limit, min(limit, math.atan(self._drive.wheel_base * target.wz / target.vx)))

    def rest(self) -> None:
        """Reset the velocity to zero."""
        self._ramp.rest()
        self._set_wheels()

    def encoders(self) -> tuple[float, ...]:
        """Return the angles in rad of the left and right rear wheel."""
        return mean_angles(self._client, self._robot, self._left + self._right, len(self._left))

    def _set_steering(self) -> None:
        tangent, ratio = math.tan(self._steering), self._drive.wheel_separation / (2 * self._drive.wheel_base)
        angles = (math.atan(tangent / (1 - tangent * ratio)), math.atan(tangent / (1 + tangent * ratio)))
        pybullet.setJointMotorControlArray(
            self._robot,
            self._knuckles,
            pybullet.POSITION_CONTROL,
            targetPositions=angles,
            forces=[self._servo_torque] * len(angles),
            positionGains=[0.5] * len(angles),
            velocityGains=[1.0] * len(angles),
            physicsClientId=self._client,
        )

    def _set_wheels(self) -> None:
        speed, joints = self._ramp.velocity.vx, self._left + self._right
        self._is_braking = speed == 0 and is_rolling(self._client, self._robot, joints, self._drive.wheel_radius)
        if speed == 0 and not self._is_braking:
            hold_wheels(self._client, self._robot, joints, self._torques)
            return
        skew = math.tan(self._steering) * self._drive.wheel_separation / (2 * self._drive.wheel_base)
        left, right = (speed * (1 - skew) / self._drive.wheel_radius, speed * (1 + skew) / self._drive.wheel_radius)
        pybullet.setJointMotorControlArray(
            self._robot,
            joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[left] * len(self._left) + [right] * len(self._right),
            forces=self._torques,
            physicsClientId=self._client,
        )
