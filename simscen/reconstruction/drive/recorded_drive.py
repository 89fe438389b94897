"""Data of a recorded drive as arrays, with times in s since the start."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2, wrap_array

Polygon = tuple[tuple[float, float], ...]
"""Corners (x, y) in m."""
Mask = npt.NDArray[np.bool_]
"""Array of booleans that selects elements."""
Indices = npt.NDArray[np.int64]
"""Array of indices."""
DEFAULT_LIDAR_HEIGHT_M = 0.2
"""Assumed height of a lidar whose mount is unknown."""


@dataclass(frozen=True, eq=False)
class TimedValues:
    """Signal with n samples.

    Attributes:
        times: Times of measurement (n,) in s, in ascending order.
        values: Values (n, k). For poses, the first three columns are x, y, yaw.
        arrivals: Log times (n,) in s.
    """

    times: Array
    values: Array
    arrivals: Array

    def __len__(self) -> int:
        return len(self.times)

    @property
    def period(self) -> float:
        """Median time between two samples in s; nan for fewer than two samples."""
        return _median_period(self.times)

    def poses_at(self, times: Array) -> Array:
        """Return the poses x, y, yaw (m, 3) at `times` (m,), by linear interpolation of the first three columns."""
        columns = [np.interp(times, self.times, self.values[:, axis]) for axis in (0, 1)]
        yaw = np.interp(times, self.times, np.unwrap(self.values[:, 2]))
        return np.column_stack((*columns, wrap_array(yaw)))

    def values_at(self, times: Array) -> Array:
        """Return the newest values (m, k) at `times` (m,). Before the first sample, these are the first values."""
        return self.values[np.maximum(np.searchsorted(self.times, times, side="right") - 1, 0)]


def _median_period(times: Array) -> float:
    return float(np.median(np.diff(times))) if len(times) > 1 else float("nan")


def usual_period(times: Array) -> float:
    """Return the usual time between messages at `times` (n,) in s; nan for fewer than two messages.

    It is the 20th percentile of the times between messages, so that gaps have no effect.
    """
    return float(np.percentile(np.diff(times), 20)) if len(times) > 1 else float("nan")


def no_values(columns: int) -> TimedValues:
    """Return a signal without samples that has this number of columns."""
    return TimedValues(np.empty(0), np.empty((0, columns)), np.empty(0))


@dataclass(frozen=True, eq=False)
class Scans:
    """Scans of one lidar in the order of measurement.

    Attributes:
        times: Times of measurement (n,) in s.
        arrivals: Log times (n,) in s.
        ranges: Ranges (n, beams) in m as in sensor_msgs/LaserScan, with nan and inf.
        angles: Beam directions (beams,) in the lidar frame in rad.
        range_min: Minimum range in m.
        range_max: Maximum range in m.
        mount: Pose of the lidar on the base.
        height: Height of the lidar above the base frame in m.
        is_malformed: Mask (n,) of scans with another number of beams than most scans. Their ranges are nan.
    """

    times: Array
    arrivals: Array
    ranges: Array
    angles: Array
    range_min: float
    range_max: float
    mount: Pose2
    height: float
    is_malformed: Mask

    def __len__(self) -> int:
        return len(self.times)

    @property
    def period(self) -> float:
        """Median time between two scans in s; nan for fewer than two scans."""
        return _median_period(self.times)

    def is_hit(self) -> Mask:
        """Return a mask (n, beams) of beams with a range within the limits of the lidar."""
        with np.errstate(invalid="ignore"):
            return np.isfinite(self.ranges) & (self.ranges >= self.range_min) & (self.ranges <= self.range_max)

    def subset(self, selection: slice | Mask) -> Scans:
        """Return the scans that a slice or a mask (n,) selects."""
        names = ("times", "arrivals", "ranges", "is_malformed")
        return replace(self, **{name: getattr(self, name)[selection] for name in names})

    def thinned(self, target: int) -> Scans:
        """Return every second, third, … scan: at least `target` and fewer than twice as many scans.

        Return all scans if there are fewer than twice as many.
        """
        return self.subset(slice(None, None, max(1, len(self) // target)))


@dataclass(frozen=True)
class RecordedGoal:
    """Goal of the drive.

    Attributes:
        name: Name of the goal; "goal-1", "goal-2", … if the log has no name.
        pose: Pose in the map frame.
        sent_time: Time in s at which the goal was accepted. If this time is unknown, time at which the goal was sent.
        end_time: Time in s of the result; None if the log has no result.
        status: "reached", "passed" (without a stop), "failed", "canceled", or "unknown".
        error: Name of the error code; "" without an error code.
        source: Source of the goal in words. It begins with `/goal_pose` if the goal is from a message on this topic.
    """

    name: str
    pose: Pose2
    sent_time: float
    end_time: float | None = None
    status: str = "unknown"
    error: str = ""
    source: str = ""


@dataclass(frozen=True, eq=False)
class RecordedDrive:
    """Data that the reconstruction uses from a log. Units are m, rad, m/s, and rad/s.

    Attributes:
        name: Name of the log.
        duration: Time in s of the last message.
        poses: Best known poses x, y, yaw (n, 3) of the base in the map frame.
        pose_source: Source of `poses` in words.
        has_true_poses: Whether `poses` are a ground truth. Otherwise, they are estimates of the robot.
        belief: Poses x, y, yaw from the localizer with the covariances xx, xy, xyaw, yy, yyaw, yawyaw (n, 9).
        corrections: Poses x, y, yaw of the odom frame in the map frame (n, 3), from /tf.
        odometry: Poses x, y, yaw in the odom frame and velocities vx, vy, wz in the base frame (n, 6).
        commands: Commanded velocities vx, vy, wz (n, 3).
        turn_rates: Turn rates of the gyroscope about the vertical axis (n, 1).
        bumper: State of the bumper (n, 1): 1 if it is pressed, otherwise 0.
        scans: Scans of the lidar frame with the most scans; None without scans.
        map: Last map in the log; None without a map.
        goals: Goals in the order in which they were sent.
        footprint: Corners (x, y) of the robot's footprint in the base frame; () if unknown.
        notes: Phrases for the user that complete the sentence "The log does not show …".
        begin: Time in s from the start of the log to the start of the drive.
    """

    name: str
    duration: float
    poses: TimedValues
    pose_source: str
    has_true_poses: bool
    belief: TimedValues = field(default_factory=lambda: no_values(9))
    corrections: TimedValues = field(default_factory=lambda: no_values(3))
    odometry: TimedValues = field(default_factory=lambda: no_values(6))
    commands: TimedValues = field(default_factory=lambda: no_values(3))
    turn_rates: TimedValues = field(default_factory=lambda: no_values(1))
    bumper: TimedValues = field(default_factory=lambda: no_values(1))
    scans: Scans | None = None
    map: OccupancyGrid | None = None
    goals: tuple[RecordedGoal, ...] = ()
    footprint: Polygon = ()
    notes: tuple[str, ...] = ()
    begin: float = 0.0

    @property
    def lidar_height(self) -> float:
        """Height of the lidar above the base frame in m; DEFAULT_LIDAR_HEIGHT_M without scans."""
        return DEFAULT_LIDAR_HEIGHT_M if self.scans is None else self.scans.height
