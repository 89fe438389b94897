"""Wheel odometry: encoder increments integrated along arcs, with random-walk errors."""

import math
from collections.abc import Callable
from operator import sub

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry
from simscen.model.robot import Drive, Mecanum, Omnidirectional, SkidSteer, WheelOdometry
from simscen.sensors.normals import NormalStream
from simscen.sensors.sensor import SensorSetting

_made = tuple.__new__  # poses and twists without the calls of their classes


class WheelOdometrySensor:
    """Dead reckoning from where the robot was switched on, which is the origin of its odom frame.

    Errors are independent from increment to increment, with variances in proportion to what was driven and turned;
    so they do not depend on the rate, and after one meter have the standard deviation that the specification says.
    """

    def __init__(self, spec: WheelOdometry, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._seconds, self._view = setting.seconds, setting.view
        # Standard deviation along the way, and variances of the heading, after one meter or radian.
        self._spread, self._twist, self._drift = spec.translation_noise, spec.rotation_noise**2, spec.drift_noise**2
        self._normals = NormalStream(setting.chance)
        self._motion = kinematics_of(setting.drive)
        self._rolled = self._view.encoders()
        self._pose = Pose2(0.0, 0.0, 0.0)

    def read(self, tick: int) -> Odometry:
        """The pose reckoned so far, and the mean velocity since the last reading."""
        rolled, before, seconds = self._view.encoders(), self._rolled, self._seconds
        self._rolled = rolled
        step = self._noisy(self._motion(tuple(map(sub, rolled, before))))
        self._pose = pose = self._pose.compose(along_arc(step))
        vx, vy, wz = step
        return Odometry(self.name, tick, pose, _made(Twist, (vx / seconds, vy / seconds, wz / seconds)))

    def _noisy(self, step: Twist) -> Twist:
        """Thrun, Burgard and Fox, Probabilistic Robotics, table 5.6, for increments."""
        vx, vy, wz = step
        driven, turned = math.hypot(vx, vy), abs(wz)
        if driven == 0 and turned == 0:
            return step
        along, across, turn = self._normals.take(3)
        spread = self._spread * math.sqrt(driven)
        heading = math.sqrt(self._twist * turned + self._drift * driven)
        return _made(Twist, (vx + spread * along, vy + (spread * across if vy else 0.0), wz + heading * turn))


def along_arc(step: Twist) -> Pose2:
    """Where a motion at constant velocity leads (the exponential map of SE(2)): m, m, rad in the base frame."""
    vx, vy, turn = step
    if abs(turn) < 1e-9:
        return _made(Pose2, (vx, vy, turn))
    sine, cosine = math.sin(turn) / turn, (1 - math.cos(turn)) / turn
    return _made(Pose2, (vx * sine - vy * cosine, vx * cosine + vy * sine, turn))


Rolled = tuple[float, ...]
Kinematics = Callable[[Rolled], Twist]


def kinematics_of(drive: Drive) -> Kinematics:
    """Turns an increment of `SensorView.encoders` into a motion of the base in its own frame (m, m, rad).

    Siegwart, Nourbakhsh and Scaramuzza, Introduction to Autonomous Mobile Robots, section 3.2; mecanum wheels: see
    MecanumWheels.
    """
    if isinstance(drive, Omnidirectional):
        return _omnidirectional
    if isinstance(drive, Mecanum):
        return _mecanum(drive)
    separation = drive.wheel_separation * (drive.turning_scale if isinstance(drive, SkidSteer) else 1.0)
    return _sided(drive.wheel_radius, separation)


def _sided(radius: float, separation: float) -> Kinematics:
    def motion(rolled: Rolled) -> Twist:
        left, right = rolled[0] * radius, rolled[1] * radius
        return _made(Twist, ((left + right) / 2, 0.0, (right - left) / separation))

    return motion


def _mecanum(drive: Mecanum) -> Kinematics:
    def motion(rolled: Rolled) -> Twist:
        front_left, front_right, rear_left, rear_right = rolled
        return drive.wheels.motion((front_left, front_right, rear_left, rear_right))

    return motion


def _omnidirectional(rolled: Rolled) -> Twist:
    return Twist(*rolled)
