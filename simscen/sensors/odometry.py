"""Wheel odometry: encoder increments integrated along arcs, with random-walk errors."""

import math
from collections.abc import Callable
from operator import sub

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry
from simscen.model.robot import Drive, Mecanum, Omnidirectional, SkidSteer, WheelOdometry
from simscen.sensors.normal_stream import NormalStream
from simscen.sensors.sensor import SensorSetting

EncoderIncrement = tuple[float, ...]
"""Difference of two values of `SensorView.encoders`."""
Kinematics = Callable[[EncoderIncrement], Twist]
"""Function from encoder increments to the motion of the base in its own frame (m, m, rad)."""
_new = tuple.__new__  # creates a named tuple without the call overhead of its class


class WheelOdometrySensor:
    """Dead reckoning; the origin of the odom frame is the initial pose of the robot.

    Errors of increments are independent, with variances proportional to the distance and the turn. They therefore do
    not depend on the rate, and the standard deviation after one meter is that of the specification.
    """

    def __init__(self, spec: WheelOdometry, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._seconds, self._view = setting.seconds, setting.view
        self._position_std = spec.translation_noise
        self._heading_variance_per_rad = spec.rotation_noise**2
        self._heading_variance_per_m = spec.drift_noise**2
        self._normals = NormalStream(setting.chance)
        self._kinematics = kinematics_of(setting.drive)
        self._encoders = self._view.encoders()
        self._pose = Pose2(0.0, 0.0, 0.0)

    def read(self, tick: int) -> Odometry:
        """Return the integrated pose and the mean velocity since the last reading."""
        encoders, before, seconds = self._view.encoders(), self._encoders, self._seconds
        self._encoders = encoders
        step = self._add_noise(self._kinematics(tuple(map(sub, encoders, before))))
        self._pose = pose = self._pose.compose(integrate_arc(step))
        vx, vy, wz = step
        return Odometry(self.name, tick, pose, _new(Twist, (vx / seconds, vy / seconds, wz / seconds)))

    def _add_noise(self, step: Twist) -> Twist:
        """Return the increment with noise (Thrun, Burgard and Fox, Probabilistic Robotics, table 5.6)."""
        vx, vy, wz = step
        distance, turn = math.hypot(vx, vy), abs(wz)
        if distance == 0 and turn == 0:
            return step
        forward_draw, lateral_draw, turn_draw = self._normals.take(3)
        position_std = self._position_std * math.sqrt(distance)
        heading_std = math.sqrt(self._heading_variance_per_rad * turn + self._heading_variance_per_m * distance)
        lateral_noise = position_std * lateral_draw if vy else 0.0
        return _new(Twist, (vx + position_std * forward_draw, vy + lateral_noise, wz + heading_std * turn_draw))


def integrate_arc(step: Twist) -> Pose2:
    """Return the pose after a motion (m, m, rad) at constant velocity: the exponential map of SE(2)."""
    vx, vy, turn = step
    if abs(turn) < 1e-9:
        return _new(Pose2, (vx, vy, turn))
    sine, cosine = math.sin(turn) / turn, (1 - math.cos(turn)) / turn
    return _new(Pose2, (vx * sine - vy * cosine, vx * cosine + vy * sine, turn))


def kinematics_of(drive: Drive) -> Kinematics:
    """Return the forward kinematics of a drive without slip.

    Source: Siegwart, Nourbakhsh and Scaramuzza, Introduction to Autonomous Mobile Robots, section 3.2; for mecanum
    wheels, see MecanumWheels.
    """
    if isinstance(drive, Omnidirectional):
        return _omnidirectional_motion
    if isinstance(drive, Mecanum):
        return _mecanum_kinematics(drive)
    separation = drive.wheel_separation * (drive.turning_scale if isinstance(drive, SkidSteer) else 1.0)
    return _two_sided_kinematics(drive.wheel_radius, separation)


def _two_sided_kinematics(radius: float, separation: float) -> Kinematics:
    def motion(increment: EncoderIncrement) -> Twist:
        left, right = increment[0] * radius, increment[1] * radius
        return _new(Twist, ((left + right) / 2, 0.0, (right - left) / separation))

    return motion


def _mecanum_kinematics(drive: Mecanum) -> Kinematics:
    def motion(increment: EncoderIncrement) -> Twist:
        front_left, front_right, rear_left, rear_right = increment
        return drive.wheels.motion((front_left, front_right, rear_left, rear_right))

    return motion


def _omnidirectional_motion(increment: EncoderIncrement) -> Twist:
    return Twist(*increment)
