"""Effects and functions that several faults use to change readings, velocity commands, and beliefs."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Image, Odometry, Reading, Scan
from simscen.faults.base import FaultEffect


def replace_map_from_odom(belief: Belief, map_from_odom: Pose2) -> Belief:
    """Return the belief with another transform from map to odom frame.

    The pose in the odom frame stays the same. The pose in the map frame changes accordingly.
    """
    odometry = belief.map_from_odom.between(belief.pose)
    return replace(belief, pose=map_from_odom.compose(odometry), map_from_odom=map_from_odom)


def apply_pose_error(belief: Belief, error: Pose2) -> Belief:
    """Return the belief with its pose and its transform from map to odom moved by `error`, given in the map frame."""
    return replace(belief, pose=error.compose(belief.pose), map_from_odom=error.compose(belief.map_from_odom))


def change_distances(reading: Reading, change: Callable[[Array], Array]) -> Reading:
    """Return a scan or image with changed finite ranges or depths. Other readings are returned unchanged.

    `change` maps an array of distances in m to the changed distances. Ranges outside the limits of the lidar become inf
    or -inf (REP 117). Negative depths become 0.
    """
    match reading:
        case Scan(ranges=ranges):
            return replace(reading, ranges=clip_to_sensor_range(reading, _change_finite(ranges, change)))
        case Image(depth=depth):
            changed = _change_finite(depth.astype(np.float64), change)
            return replace(reading, depth=np.maximum(changed, 0.0).astype(np.float32))
        case _:
            return reading


def _change_finite(distances: Array, change: Callable[[Array], Array]) -> Array:
    return np.where(np.isfinite(distances), change(distances), distances)


def clip_to_sensor_range(scan: Scan, ranges: Array) -> Array:
    """Return the ranges with inf above the maximum range of the scan and -inf below its minimum range (REP 117)."""
    with np.errstate(invalid="ignore"):
        ranges = np.where(ranges > scan.range_max, np.inf, ranges)
        return np.where(ranges < scan.range_min, -np.inf, ranges)


def ranges_with_scan_errors(scan: Scan, new_distances: Array, scan_distances: Array) -> Array:
    """Return the ranges (n,) in m that the lidar would report if the true distances were `new_distances` (n,).

    Each beam keeps its measurement error: the range in the scan minus the true distance `scan_distances` (n,) of the
    scan. The result is rounded to whole millimeters.
    """
    with np.errstate(invalid="ignore"):
        errors = scan.ranges - scan_distances
    # Rounded, so that rounding errors in the last bits have no effect on the run.
    ranges = np.round(new_distances + np.where(np.isfinite(errors), errors, 0.0), 3)
    return clip_to_sensor_range(scan, ranges)


class ChangedReadings(FaultEffect):
    """Effect that changes only readings, by the function `change`."""

    def __init__(self, change: Callable[[Reading], Reading]) -> None:
        self._change = change

    def reading(self, reading: Reading) -> Reading:
        return self._change(reading)


class ChangedRanges(FaultEffect):
    """Effect that changes only scans. The function `ranges` returns the changed ranges (n,) of a scan in m."""

    def __init__(self, ranges: Callable[[Scan], Array]) -> None:
        self._ranges = ranges

    def reading(self, reading: Reading) -> Reading:
        return replace(reading, ranges=self._ranges(reading)) if isinstance(reading, Scan) else reading


class ChangedCommands(FaultEffect):
    """Effect that changes only velocity commands, by the function `change`."""

    def __init__(self, change: Callable[[Twist], Twist]) -> None:
        self._change = change

    def command(self, command: Twist) -> Twist:
        return self._change(command)


MAX_ODOMETRY_VALUE = 1e6
"""Odometry with a coordinate in m or a heading in rad beyond this absolute value is implausible."""


class OdometryDistortion(FaultEffect):
    """Effect that distorts each odometry increment, and integrates the distorted increments to a pose.

    The reported pose does not jump when the fault begins. The accumulated error remains when the fault ends.
    Implausible values from another fault, such as nan, are returned unchanged, and are not part of any increment.
    """

    def __init__(self, distort: Callable[[Twist, Twist, int], tuple[Twist, Twist]]) -> None:
        """Take the function `distort`.

        Its arguments are an increment (m, m, rad), the velocity (m/s, m/s, rad/s) at the end of the increment, and the
        duration of the increment in ticks. It returns the distorted increment and velocity.
        """
        self._distort = distort
        self._previous: dict[str, tuple[Odometry, Pose2]] = {}
        """Last true reading and last reported pose by sensor."""
        self._has_ended = False

    def reading(self, reading: Reading) -> Reading:
        """Return the distorted odometry. Implausible odometry and other readings are returned unchanged."""
        if not (isinstance(reading, Odometry) and all(abs(value) <= MAX_ODOMETRY_VALUE for value in reading.pose)):
            return reading
        previous, pose = self._previous.get(reading.sensor, (reading, reading.pose))
        step, velocity = Twist(*previous.pose.between(reading.pose)), reading.twist
        if not self._has_ended:
            step, velocity = self._distort(step, velocity, reading.tick - previous.tick)
        pose = pose.compose(Pose2(*step))
        self._previous[reading.sensor] = reading, pose
        return replace(reading, pose=pose, twist=velocity)

    def end(self) -> FaultEffect:
        """Stop the distortion, and return this effect, which adds the accumulated error to all later readings."""
        self._has_ended = True
        return self
