"""Drives of a wheeled base: differential, skid-steer, and Ackermann."""

import math

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import Ackermann, Differential, SkidSteer
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import pybullet
from simscen.sim.robots.velocity_ramp import VelocityRamp
from simscen.sim.robots.wheeled_base import WheeledBase

MAX_HOLD_SPEED_M_S = 0.1
"""Largest rim speed at which the motors hold the position of a wheel. A faster wheel is braked first."""
MAX_STEERING_RATE_RAD_S = 3.2
"""Largest steering rate; the value is from F1TENTH cars (f1tenth_gym, sv_max; O'Kelly et al. 2020)."""
MIN_STEERING_SPEED_M_S = 0.01
"""Commanded speed below which the steering angle does not change."""


class WheelDrive:
    """Motors of the driven wheels. Each subclass computes the wheel speeds from the velocity of the base."""

    def __init__(self, client: int, base: WheeledBase, body: RobotBody, period: float) -> None:
        """Take the base that the motors move. `period` is the time in s between two calls of `advance`."""
        assert isinstance(body.drive, Differential | SkidSteer | Ackermann)
        self._client, self._robot, self._radius = client, base.id, body.drive.wheel_radius
        self._ramp = VelocityRamp(body.limits, period, is_holonomic=False)
        wheels = [(wheel, joint) for wheel, joint in zip(body.wheels, base.joints, strict=True) if wheel.is_driven]
        wheels.sort(key=lambda pair: not pair[0].is_left)
        self._joints = [joint for _, joint in wheels]
        self._torques = [wheel.stall_torque for wheel, _ in wheels]
        self._left_count = sum(wheel.is_left for wheel, _ in wheels)
        self._right_count = len(wheels) - self._left_count
        self._is_braking = False
        self._set_wheels()

    def command(self, twist: Twist) -> None:
        """Set the commanded velocity in the base frame; its lateral component is ignored."""
        self._ramp.command(twist)

    def advance(self) -> None:
        """Run one period of the firmware: change the wheel speeds towards the command."""
        if self._ramp.advance() or self._is_braking:
            self._set_wheels()

    def rest(self) -> None:
        """Reset the velocity to zero."""
        self._ramp.rest()
        self._set_wheels()

    def encoders(self) -> tuple[float, ...]:
        """Return two mean angles in rad: of the driven wheels on the left, and on the right."""
        states = pybullet.getJointStates(self._robot, self._joints, self._client)
        if len(states) == 2:
            return states[0][0], states[1][0]
        angles = [state[0] for state in states]
        return sum(angles[: self._left_count]) / self._left_count, sum(angles[self._left_count :]) / self._right_count

    def _wheel_speeds(self) -> tuple[float, float]:
        """Return the speeds in rad/s of the left and of the right driven wheels at the current velocity."""
        raise NotImplementedError

    def _set_wheels(self) -> None:
        """Set the target speeds of the wheel motors, or hold the wheels if the robot is at rest."""
        left, right = self._wheel_speeds()
        self._is_braking = False
        if left == right == 0:
            states = pybullet.getJointStates(self._robot, self._joints, self._client)
            self._is_braking = any(abs(state[1]) * self._radius > MAX_HOLD_SPEED_M_S for state in states)
            if not self._is_braking:
                # Position control, because a robot with speed control would creep.
                pybullet.setJointMotorControlArray(
                    self._robot,
                    self._joints,
                    pybullet.POSITION_CONTROL,
                    targetPositions=[state[0] for state in states],
                    forces=self._torques,
                    physicsClientId=self._client,
                )
                return
        pybullet.setJointMotorControlArray(
            self._robot,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[left] * self._left_count + [right] * self._right_count,
            forces=self._torques,
            physicsClientId=self._client,
        )


class DifferentialDrive(WheelDrive):
    """Differential or skid-steer drive: all wheels on a side turn at the same speed."""

    def __init__(self, client: int, base: WheeledBase, body: RobotBody, period: float) -> None:
        drive = body.drive
        assert isinstance(drive, Differential | SkidSteer)
        scale = drive.turning_scale if isinstance(drive, SkidSteer) else 1.0
        self._half_separation = drive.wheel_separation * scale / 2
        super().__init__(client, base, body, period)

    def _wheel_speeds(self) -> tuple[float, float]:
        vx, _, wz = self._ramp.velocity
        return (vx - wz * self._half_separation) / self._radius, (vx + wz * self._half_separation) / self._radius


class AckermannDrive(WheelDrive):
    """Drive of a car that steers its front wheels. It cannot turn in place.

    The steering angle follows from the bicycle model: tan(steering angle) = wheel base * turn rate / speed. The angle
    of each front wheel depends on its lateral position (Ackermann condition; Siegwart et al., Autonomous Mobile Robots,
    section 3.3).
    """

    def __init__(self, client: int, base: WheeledBase, body: RobotBody, period: float) -> None:
        assert isinstance(body.drive, Ackermann)
        self._drive = body.drive
        self._max_steering_step = MAX_STEERING_RATE_RAD_S * period
        self._steering = 0.0
        steered = [pair for pair in zip(body.wheels, base.joints, strict=True) if pair[0].is_steered]
        self._knuckles = [joint for _, joint in steered]
        self._lateral_ratios = [wheel.y / body.drive.wheel_base for wheel, _ in steered]
        self._servo_torque = 0.5 * body.mass * GRAVITY_M_S2 * body.drive.wheel_radius
        super().__init__(client, base, body, period)
        # The front wheels roll freely.
        rolling = [joint + 1 for joint in self._knuckles]
        pybullet.setJointMotorControlArray(
            self._robot, rolling, pybullet.VELOCITY_CONTROL, forces=[0.0] * len(rolling), physicsClientId=client
        )
        self._set_steering()

    def advance(self) -> None:
        """Run one period of the firmware: steer and accelerate towards the command."""
        target, steering = self._ramp.target, self._steering
        if abs(target.vx) >= MIN_STEERING_SPEED_M_S:
            limit = self._drive.max_steering
            steering = max(-limit, min(limit, math.atan(self._drive.wheel_base * target.wz / target.vx)))
        if steering != self._steering:
            max_step = self._max_steering_step
            self._steering += max(-max_step, min(max_step, steering - self._steering))
            self._set_steering()
            self._ramp.advance()
            self._set_wheels()
        else:
            super().advance()

    def _set_steering(self) -> None:
        """Set the target angles of the steering joints for the present steering angle of the bicycle model."""
        tangent = math.tan(self._steering)
        angles = [math.atan(tangent / (1 - tangent * ratio)) for ratio in self._lateral_ratios]
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

    def _wheel_speeds(self) -> tuple[float, float]:
        speed = self._ramp.velocity.vx
        # Relative difference between the speeds of the right rear wheel and of the center of the rear axle.
        right_excess = math.tan(self._steering) * self._drive.wheel_separation / (2 * self._drive.wheel_base)
        return speed * (1 - right_excess) / self._radius, speed * (1 + right_excess) / self._radius
