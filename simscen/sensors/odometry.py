"""Wheel odometry with random errors that accumulate."""

import math
from collections.abc import Callable
from operator import sub

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import UNKNOWN_POSE_COVARIANCE, Odometry
from simscen.model.robot import Drive, Mecanum, Omnidirectional, SkidSteer
from simscen.model.sensors import WheelOdometry
from simscen.sensors.sensor import NormalStream, SensorSetting

EncoderIncrement = tuple[float, ...]
"""Change of each encoder between two readings; see `SensorView.encoders` for the elements."""
Displacement = Twist
"""Motion of the base between two readings, in the base frame: forward (m), left (m), and turn (rad)."""
Kinematics = Callable[[EncoderIncrement], Displacement]
"""Returns the displacement for an encoder increment."""
Variances = tuple[float, float, float]
"""Variances of the errors of a displacement: forward (m²), left (m²), and turn (rad²)."""
_new_tuple = tuple.__new__
"""Creates a named tuple faster than a call of its class."""


class WheelOdometrySensor:
    """Dead reckoning from wheel encoders. The origin of the odom frame is the initial pose of the robot.

    The errors of displacements are independent. Their variances are proportional to distance and turn, so that the
    accumulated error does not depend on the rate. Readings contain the variances of the velocity and the covariance of
    the pose.
    """

    def __init__(self, spec: WheelOdometry, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._seconds, self._view = setting.seconds, setting.view
        self._position_variance_per_m = spec.translation_noise**2
        self._heading_variance_per_rad = spec.rotation_noise**2
        self._heading_variance_per_m = spec.drift_noise**2
        self._normals = NormalStream(setting.rng)
        self._kinematics = kinematics_of(setting.drive)
        self._encoders = self._view.encoders()
        self._pose, self._covariance = Pose2(0.0, 0.0, 0.0), UNKNOWN_POSE_COVARIANCE

    def read(self, tick: int) -> Odometry:
        """Return the integrated pose and the mean velocity since the last reading."""
        encoders, before, seconds = self._view.encoders(), self._encoders, self._seconds
        self._encoders = encoders
        exact = self._kinematics(tuple(map(sub, encoders, before)))
        forward_variance, lateral_variance, turn_variance = variances = self._variances(exact)
        has_noise = forward_variance > 0 or turn_variance > 0
        step = self._add_noise(exact, variances) if has_noise else exact
        last, self._pose = self._pose, self._pose.compose(integrate_arc(step))
        pose, (dx, dy, turn) = self._pose, step
        if has_noise:
            self._grow_covariance(last, pose, variances)
        twist = _new_tuple(Twist, (dx / seconds, dy / seconds, turn / seconds))
        squared = seconds * seconds
        twist_variance = forward_variance / squared, lateral_variance / squared, turn_variance / squared
        return Odometry(self.name, tick, pose, twist, twist_variance, self._covariance)

    def _variances(self, step: Displacement) -> Variances:
        """Return the variances of the errors of a displacement (Probabilistic Robotics, table 5.6)."""
        dx, dy, turn = step
        distance = math.hypot(dx, dy)
        position = self._position_variance_per_m * distance
        heading = self._heading_variance_per_rad * abs(turn) + self._heading_variance_per_m * distance
        return position, position if dy else 0.0, heading

    def _add_noise(self, step: Displacement, variances: Variances) -> Displacement:
        """Return the displacement with random errors of these variances."""
        forward_draw, lateral_draw, turn_draw = self._normals.take(3)
        (dx, dy, turn), (forward_variance, lateral_variance, turn_variance) = step, variances
        return _new_tuple(Twist, (
            dx + math.sqrt(forward_variance) * forward_draw, dy + math.sqrt(lateral_variance) * lateral_draw,
            turn + math.sqrt(turn_variance) * turn_draw,
        ))  # fmt: skip

    def _grow_covariance(self, last: Pose2, pose: Pose2, variances: Variances) -> None:
        """Propagate the pose covariance to first order from `last` to `pose`, for a displacement with `variances`."""
        xx, xy, xa, _, yy, ya, _, _, aa = self._covariance  # a: yaw
        forward, lateral, turn = variances
        dx, dy, heading = pose.x - last.x, pose.y - last.y, (pose.yaw + last.yaw) / 2
        if abs(pose.yaw - last.yaw) > math.pi:  # the yaw has wrapped around
            heading += math.pi
        c, s = math.cos(heading), math.sin(heading)
        xa_new, ya_new = xa - dy * aa, ya + dx * aa
        xy += dx * xa - dy * ya_new + c * s * (forward - lateral)
        xx += c * c * forward + s * s * lateral - dy * (xa + xa_new)
        yy += s * s * forward + c * c * lateral + dx * (ya + ya_new)
        self._covariance = xx, xy, xa_new, xy, yy, ya_new, xa_new, ya_new, aa + turn


def integrate_arc(step: Displacement) -> Pose2:
    """Return the pose after driving a displacement from the origin at constant velocity (exponential map of SE(2))."""
    dx, dy, turn = step
    if abs(turn) < 1e-9:
        return _new_tuple(Pose2, (dx, dy, turn))
    sine, cosine = math.sin(turn) / turn, (1 - math.cos(turn)) / turn
    return _new_tuple(Pose2, (dx * sine - dy * cosine, dx * cosine + dy * sine, turn))


def kinematics_of(drive: Drive) -> Kinematics:
    """Return the forward kinematics of a drive without wheel slip.

    Source: Siegwart, Nourbakhsh and Scaramuzza, Introduction to Autonomous Mobile Robots, section 3.2.
    """
    if isinstance(drive, Omnidirectional):
        return lambda increment: Twist(*increment)
    if isinstance(drive, Mecanum):
        wheels = drive.wheels
        return lambda increment: wheels.motion((increment[0], increment[1], increment[2], increment[3]))
    radius = drive.wheel_radius
    separation = drive.wheel_separation * (drive.turning_scale if isinstance(drive, SkidSteer) else 1.0)

    def two_sided_motion(increment: EncoderIncrement) -> Displacement:
        left, right = increment[0] * radius, increment[1] * radius
        return _new_tuple(Twist, ((left + right) / 2, 0.0, (right - left) / separation))

    return two_sided_motion
