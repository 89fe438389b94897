"""Helpers that several faults share: range arithmetic, wheel speeds, and odometry increments."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from pydantic import BaseModel

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Image, Odometry, Reading, Scan
from simscen.faults.base import Disturbance, Fault, Instance


def inapplicable_key(fault: Fault, instance: Instance) -> tuple[str, str] | None:
    """A key that is given and means nothing there, and why."""
    assert isinstance(fault, BaseModel)
    fitting = fault.keys_of[instance.kind]
    given = [name for name in type(fault).model_fields if name in fault.model_fields_set]
    wrong = next((name for name in given if name not in fitting), None)
    if wrong is None:
        return None
    only = f"only `{'`, `'.join(fitting)}` {'does' if len(fitting) == 1 else 'do'}"
    return wrong, f"`{wrong}` means nothing there, {only}"


# Corrections of the localizer that arrive late, partly or not at all.
def apply_correction(belief: Belief, correction: Pose2) -> Belief:
    """The belief of somebody who knows the odometry of now and a correction from map to odometry of another time."""
    odometry = belief.map_from_odom.between(belief.pose)
    return replace(belief, pose=correction.compose(odometry), map_from_odom=correction)


# Faults of the wheels on one side of the robot.
def side_speeds(motion: Twist, separation: float) -> tuple[float, float]:
    """How fast the wheels on the left and on the right roll over ground, in m/s."""
    half = separation / 2
    return motion.vx - half * motion.wz, motion.vx + half * motion.wz


def twist_from_sides(left: float, right: float, sideways: float, separation: float) -> Twist:
    """The motion of a base whose sides roll like this."""
    return Twist((left + right) / 2, sideways, (right - left) / separation)


def inapplicable_side(instance: Instance, key: str) -> tuple[str, str] | None:
    """Why a key that names a side means nothing on a drive without sides, or on a velocity command."""
    if instance.kind != "Wheels":
        return key, f"`{key}` means nothing there: a command has no sides; say it of `wheels`"
    if instance.spec is not None and not getattr(instance.spec, "wheel_separation", 0.0):
        return key, f"`{key}` means nothing there: this drive has no left and right wheels"
    return None


# Faults that change odometry increments.
class OdometryDistortion(Disturbance):
    """Falsifies each increment of odometry and adds the increments up again.

    The reported pose starts at the sensor's own, so that nothing jumps when the fault begins. When the fault is over
    the error made so far stays, as it does on a real robot; only new increments are true again. Of several sensors
    each has its own sum.
    """

    def __init__(self) -> None:
        self._sums: dict[str, tuple[Odometry, Pose2]] = {}
        self._over = False

    @abstractmethod
    def increment(self, step: Twist) -> Twist:
        """What is reported for a true increment (m, m, rad) or velocity (m/s, m/s, rad/s)."""

    def reported(self, step: Twist, twist: Twist, ticks: int) -> tuple[Twist, Twist]:
        """What is reported for an increment over some ticks, and for the velocity at its end."""
        return self.increment(step), self.increment(twist)

    def reading(self, reading: Reading) -> Reading | None:
        """The odometry with falsified increments."""
        if not isinstance(reading, Odometry):
            return reading
        before, pose = self._sums.get(reading.sensor, (reading, reading.pose))
        step, twist = Twist(*before.pose.between(reading.pose)), reading.twist
        if not self._over:
            step, twist = self.reported(step, twist, reading.tick - before.tick)
        pose = pose.compose(Pose2(*step))
        self._sums[reading.sensor] = reading, pose
        return replace(reading, pose=pose, twist=twist)

    def end(self) -> Disturbance | None:
        """The error stays."""
        self._over = True
        return self


def with_distances(reading: Reading, change: Callable[[Array], Array]) -> Reading:
    """The reading with other distances; beams and pixels without an answer, or without a hit, keep what they say.

    What a lidar measures beyond its range is no hit (inf), what it measures below gives no answer (nan).
    """
    match reading:
        case Scan(ranges=ranges):
            return replace(reading, ranges=clip_to_sensor_range(reading, _changed(ranges, change)))
        case Image(depth=depth):
            changed = _changed(depth.astype(np.float64), change)
            return replace(reading, depth=np.maximum(changed, 0.0).astype(np.float32))
        case _:
            return reading


def clip_to_sensor_range(scan: Scan, ranges: Array) -> Array:
    """Ranges as the lidar of a scan tells them."""
    with np.errstate(invalid="ignore"):
        ranges = np.where(ranges > scan.range_max, np.inf, ranges)
        return np.where(ranges < scan.range_min, np.nan, ranges)


def _changed(distances: Array, change: Callable[[Array], Array]) -> Array:
    return np.where(np.isfinite(distances), change(distances), distances)


def ranges_with_scan_errors(scan: Scan, distances: Array, nominal: Array) -> Array:
    """What the lidar of a scan would have said at other true distances: with the errors of the scan itself.

    `nominal` are the true distances at which it said what it did. In whole millimeters: last bits do not spread.
    """
    with np.errstate(invalid="ignore"):
        errors = scan.ranges - nominal
    told = np.round(distances + np.where(np.isfinite(errors), errors, 0.0), 3)
    return clip_to_sensor_range(scan, told)
