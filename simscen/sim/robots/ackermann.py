"""Cars: two rear wheels drive, two front wheels steer."""

import math

import pybullet

from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import Ackermann
from simscen.sim.body.inertia import GRAVITY
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.robots.differential import driven_joints, hold_wheels, is_rolling, mean_angles
from simscen.sim.robots.velocity_ramp import VelocityRamp
from simscen.sim.robots.wheeled_base import WheeledBase

STEERING_RATE = 3.2
"""rad/s: what the servo of an F1TENTH car does (f1tenth_gym, sv_max; O'Kelly et al. 2020)."""
CREEP = 0.01
"""m/s below which a curvature cannot be told from a twist; the wheels then stay as they are steered."""


class AckermannDrive:
    """The bicycle model's inverse: curvature = turn rate / speed, tan(steering) = wheel base * curvature.

    Each front wheel is steered about the same center as the rear axle turns about (Ackermann's condition; Siegwart et
    al., Autonomous Mobile Robots, section 3.3). A twist that turns on the spot cannot be driven.
    """

    def __init__(self, client: int, vehicle: WheeledBase, body: RobotBody, period: float) -> None:
        assert isinstance(body.drive, Ackermann)
        self._client, self._robot, self._drive = client, vehicle.id, body.drive
        self._ramp = VelocityRamp(body.limits, period, holonomic=False)
        self._most = STEERING_RATE * period
        self._steering = 0.0
        wheels = list(zip(body.wheels, vehicle.joints, strict=True))
        self._left, self._right, self._torques = driven_joints(body, vehicle)
        # The left before the right, as the angles in _steer.
        self._knuckles = [joint for wheel, joint in sorted(wheels, key=lambda w: -w[0].y) if wheel.steered]
        self._servo = 0.5 * body.mass * GRAVITY * body.drive.wheel_radius
        rolling = [joint + 1 for joint in self._knuckles]
        pybullet.setJointMotorControlArray(
            self._robot, rolling, pybullet.VELOCITY_CONTROL, forces=[0.0] * len(rolling), physicsClientId=client
        )
        self._still_rolls = False
        self._steer()
        self._turn()

    def command(self, twist: Twist) -> None:
        """Drive this from now on, as far as a car can."""
        self._ramp.command(twist)

    def advance(self) -> None:
        """Steer and accelerate towards the command."""
        steering = self._wanted()
        if steering != self._steering:
            self._steering += max(-self._most, min(self._most, steering - self._steering))
            self._steer()
            self._ramp.advance()
            self._turn()
        elif self._ramp.advance() or self._still_rolls:
            self._turn()

    def _wanted(self) -> float:
        target, most = self._ramp.target, self._drive.max_steering
        if abs(target.vx) < CREEP:
            return self._steering
        return max(-most, min(most, math.atan(self._drive.wheel_base * target.wz / target.vx)))

    def rest(self) -> None:
        """Start again from standstill."""
        self._ramp.rest()
        self._turn()

    def encoders(self) -> tuple[float, ...]:
        """Angles in rad of the rear wheels."""
        return mean_angles(self._client, self._robot, self._left + self._right, len(self._left))

    def _steer(self) -> None:
        slope, half = math.tan(self._steering), self._drive.wheel_separation / (2 * self._drive.wheel_base)
        angles = (math.atan(slope / (1 - slope * half)), math.atan(slope / (1 + slope * half)))
        pybullet.setJointMotorControlArray(
            self._robot,
            self._knuckles,
            pybullet.POSITION_CONTROL,
            targetPositions=angles,
            forces=[self._servo] * len(angles),
            positionGains=[0.5] * len(angles),
            velocityGains=[1.0] * len(angles),
            physicsClientId=self._client,
        )

    def _turn(self) -> None:
        speed, joints = self._ramp.velocity.vx, self._left + self._right
        self._still_rolls = speed == 0 and is_rolling(self._client, self._robot, joints, self._drive.wheel_radius)
        if speed == 0 and not self._still_rolls:
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
