"""Drives of a wheeled base: differential, skid-steer, and Ackermann; and the velocity ramp of all drives."""

import math
from collections.abc import Sequence

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.robot import Ackermann, Differential, Limits, SkidSteer
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import pybullet
from simscen.sim.robots.wheeled_base import WheeledBase


class VelocityRamp:
    """Velocity that follows commands within the limits of speed and acceleration.

    Takes one step every `period` seconds. Only a holonomic robot can move sideways.
    """

    def __init__(self, limits: Limits, period: float, is_holonomic: bool) -> None:
        self._limits = limits
        self._max_lateral = (limits.lateral or limits.linear) if is_holonomic else 0.0
        self._speed_up_step = limits.linear_acceleration * period
        self._slow_down_step = (limits.linear_deceleration or limits.linear_acceleration) * period
        self._turn_step = limits.angular_acceleration * period
        self._command = self.target = STOP
        self.velocity = STOP

    def command(self, twist: Twist) -> None:
        """Set the target velocity; the limits of speed are applied to it."""
        if twist == self._command:
            return
        limits, self._command = self._limits, twist
        self.target = Twist(
            min(limits.linear, max(-(limits.reverse or limits.linear), twist.vx)),
            min(self._max_lateral, max(-self._max_lateral, twist.vy)),
            min(limits.angular, max(-limits.angular, twist.wz)),
        )

    def advance(self) -> bool:
        """Take one step towards the target velocity; return whether the velocity changed."""
        (vx, vy, wz), (target_vx, target_vy, target_wz) = now, target = self.velocity, self.target
        if now == target:
            return False
        up, down, turn = self._speed_up_step, self._slow_down_step, self._turn_step
        self.velocity = Twist(
            vx if vx == target_vx else _step_towards(vx, target_vx, up, down),
            vy if vy == target_vy else _step_towards(vy, target_vy, up, down),
            wz if wz == target_wz else _step_towards(wz, target_wz, turn, turn),
        )
        return True

    def rest(self) -> None:
        """Set the velocity to zero, and keep the target velocity."""
        self.velocity = STOP


def _step_towards(now: float, target: float, speed_up: float, slow_down: float) -> float:
    """Return `now` changed towards `target` by at most `speed_up` or `slow_down`; stops at 0 if the sign differs."""
    step = speed_up if now * target >= 0 and abs(target) > abs(now) else slow_down
    if now * target < 0:
        target = 0.0
    return target if abs(target - now) <= step else now + (step if target > now else -step)


MAX_HOLD_SPEED_M_S = 0.1
"""Largest rim speed at which the motors hold the position of a wheel. A faster wheel is braked first."""


class DifferentialDrive:
    """Differential or skid-steer drive: all wheels on a side turn at the same speed."""

    def __init__(self, client: int, vehicle: WheeledBase, body: RobotBody, period: float) -> None:
        drive = body.drive
        assert isinstance(drive, Differential | SkidSteer)
        self._client, self._vehicle = client, vehicle
        self._ramp = VelocityRamp(body.limits, period, is_holonomic=False)
        self._radius = drive.wheel_radius
        scale = drive.turning_scale if isinstance(drive, SkidSteer) else 1.0
        self._half_separation = drive.wheel_separation * scale / 2
        self._left, self._right, self._torques = driven_joints(body, vehicle)
        self._joints = self._left + self._right
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
        """Return two mean angles in rad: of the left wheels, and of the right wheels."""
        return mean_angles(self._client, self._vehicle.id, self._joints, len(self._left))

    def _set_wheels(self) -> None:
        """Set the target speeds of the wheel motors, or hold the wheels if the robot is at rest."""
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
    """Return the left joints, the right joints, and the stall torques in N m (left before right) of driven wheels."""
    wheels = [(w, joint) for w, joint in zip(body.wheels, vehicle.joints, strict=True) if w.is_driven]
    left, right = [pair for pair in wheels if pair[0].is_left], [pair for pair in wheels if not pair[0].is_left]
    return [j for _, j in left], [j for _, j in right], [w.stall_torque for w, _ in left + right]


def is_rolling(client: int, robot: int, joints: Sequence[int], radius: float) -> bool:
    """Return whether any wheel turns faster than MAX_HOLD_SPEED_M_S; `radius` is the radius of the wheels in m."""
    speeds = (pybullet.getJointState(robot, joint, physicsClientId=client)[1] for joint in joints)
    return any(abs(speed) * radius > MAX_HOLD_SPEED_M_S for speed in speeds)


def hold_wheels(client: int, robot: int, joints: Sequence[int], torques: Sequence[float]) -> None:
    """Hold the current wheel angles with position control, so that the robot does not creep."""
    angles = [pybullet.getJointState(robot, joint, physicsClientId=client)[0] for joint in joints]
    pybullet.setJointMotorControlArray(
        robot, joints, pybullet.POSITION_CONTROL, targetPositions=angles, forces=torques, physicsClientId=client
    )


def mean_angles(client: int, robot: int, joints: Sequence[int], left_count: int) -> tuple[float, float]:
    """Return two mean angles in rad: of the first `left_count` joints, and of the remaining joints."""
    states = pybullet.getJointStates(robot, joints, client)
    if len(states) == 2:
        return states[0][0], states[1][0]
    angles = [state[0] for state in states]
    return sum(angles[:left_count]) / left_count, sum(angles[left_count:]) / (len(angles) - left_count)


STEERING_RATE_RAD_S = 3.2
"""Largest steering rate; the value is from F1TENTH cars (f1tenth_gym, sv_max; O'Kelly et al. 2020)."""
MIN_STEERING_SPEED_M_S = 0.01
"""Commanded speed below which the steering angle does not change."""


class AckermannDrive:
    """Drive of a car that steers its front wheels. It cannot turn in place.

    The steering angle follows from the bicycle model: tan(steering angle) = wheel base * turn rate / speed. The angles
    of the two front wheels differ (Ackermann condition; Siegwart et al., Autonomous Mobile Robots, section 3.3).
    """

    def __init__(self, client: int, vehicle: WheeledBase, body: RobotBody, period: float) -> None:
        assert isinstance(body.drive, Ackermann)
        self._client, self._robot, self._drive = client, vehicle.id, body.drive
        self._ramp = VelocityRamp(body.limits, period, is_holonomic=False)
        self._max_steering_step = STEERING_RATE_RAD_S * period
        self._steering = 0.0
        wheels = list(zip(body.wheels, vehicle.joints, strict=True))
        self._left, self._right, self._torques = driven_joints(body, vehicle)
        # Left before right, like the angles in _set_steering.
        self._knuckles = [joint for wheel, joint in sorted(wheels, key=lambda w: -w[0].y) if wheel.is_steered]
        self._servo_torque = 0.5 * body.mass * GRAVITY_M_S2 * body.drive.wheel_radius
        # The front wheels roll freely.
        rolling = [joint + 1 for joint in self._knuckles]
        pybullet.setJointMotorControlArray(
            self._robot, rolling, pybullet.VELOCITY_CONTROL, forces=[0.0] * len(rolling), physicsClientId=client
        )
        self._is_braking = False
        self._set_steering()
        self._set_wheels()

    def command(self, twist: Twist) -> None:
        """Set the commanded velocity in the base frame; its lateral component is ignored."""
        self._ramp.command(twist)

    def advance(self) -> None:
        """Run one period of the firmware: steer and accelerate towards the command."""
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
        """Return the steering angle in rad that the commanded velocity requires."""
        target, limit = self._ramp.target, self._drive.max_steering
        if abs(target.vx) < MIN_STEERING_SPEED_M_S:
            return self._steering
        return max(-limit, min(limit, math.atan(self._drive.wheel_base * target.wz / target.vx)))

    def rest(self) -> None:
        """Reset the velocity to zero."""
        self._ramp.rest()
        self._set_wheels()

    def encoders(self) -> tuple[float, ...]:
        """Return two angles in rad: of the left rear wheel, and of the right rear wheel."""
        return mean_angles(self._client, self._robot, self._left + self._right, len(self._left))

    def _set_steering(self) -> None:
        """Set the target angles of both front wheels."""
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
        """Set the target speeds of the wheel motors, or hold the wheels if the robot is at rest."""
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
