"""Wheel odometry: encoder increments added up along arcs, with errors that grow like a random walk."""

import math

from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.core.sensing import Odometry
from simscen.model.robot import WheelOdometry
from simscen.sensors.kinematics import kinematics_of
from simscen.sensors.normals import Normals
from simscen.sensors.sensor import SensorSetting


class WheelOdometrySensor:
    """Dead reckoning from where the robot was switched on, which is the origin of its odom frame.

    Errors are independent from increment to increment, with variances in proportion to what was driven and turned;
    so they do not depend on the rate, and after one metre have the standard deviation that the specification says.
    """

    def __init__(self, spec: WheelOdometry, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._spec, self._seconds, self._view = spec, setting.seconds, setting.view
        self._normals = Normals(setting.chance)
        self._motion = kinematics_of(setting.drive)
        self._rolled = self._view.encoders()
        self._pose = Pose2(0.0, 0.0, 0.0)

    def read(self, tick: int) -> Odometry:
        """The pose reckoned so far, and the mean velocity since the last reading."""
        rolled = self._view.encoders()
        step = self._noisy(self._motion(tuple([b - a for a, b in zip(self._rolled, rolled, strict=True)])))
        self._rolled = rolled
        self._pose = self._pose.compose(along_arc(step))
        seconds = self._seconds
        return Odometry(self.name, tick, self._pose, Twist(step.vx / seconds, step.vy / seconds, step.wz / seconds))

    def _noisy(self, step: Twist) -> Twist:
        """Thrun, Burgard and Fox, Probabilistic Robotics, table 5.6, for increments."""
        spec = self._spec
        driven, turned = math.hypot(step.vx, step.vy), abs(step.wz)
        if driven == 0 and turned == 0:
            return step
        along, across, turn = self._normals.take(3)
        spread = spec.translation_noise * math.sqrt(driven)
        heading = math.sqrt(spec.rotation_noise**2 * turned + spec.drift_noise**2 * driven)
        sideways = spread * across if step.vy else 0.0
        return Twist(step.vx + spread * along, step.vy + sideways, step.wz + heading * turn)


def along_arc(step: Twist) -> Pose2:
    """Where a motion at constant velocity leads (the exponential map of SE(2)): m, m, rad in the base frame."""
    turn = step.wz
    if abs(turn) < 1e-9:
        return Pose2(step.vx, step.vy, turn)
    sine, cosine = math.sin(turn) / turn, (1 - math.cos(turn)) / turn
    return Pose2(step.vx * sine - step.vy * cosine, step.vx * cosine + step.vy * sine, turn)
