"""A recorded drive as arrays with times in s since the start, and its motion in short steps."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2, wrap_array

Polygon = tuple[tuple[float, float], ...]
Mask = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class TimedValues:
    """Values (n, k) of a signal: `times` (n,) of measurement in ascending order, `arrivals` (n,) of logging, in s."""

    times: Array
    values: Array
    arrivals: Array

    def __len__(self) -> int:
        return len(self.times)

    @property
    def period(self) -> float:
        """Usual time between two messages in s; nan for fewer than two messages."""
        return float(np.median(np.diff(self.times))) if len(self) > 1 else float("nan")

    def poses_at(self, times: Array) -> Array:
        """Return poses x, y, yaw (m, 3) at `times` (m,), interpolated linearly; held before the first and the last."""
        columns = [np.interp(times, self.times, self.values[:, axis]) for axis in (0, 1)]
        yaw = np.interp(times, self.times, np.unwrap(self.values[:, 2]))
        return np.column_stack((*columns, wrap_array(yaw)))

    def values_at(self, times: Array) -> Array:
        """Return the newest values (m, k) at `times` (m,); before the first, the first."""
        return self.values[np.maximum(np.searchsorted(self.times, times, side="right") - 1, 0)]


USUAL_PERIOD_PERCENTILE = 20
"""Percentile of the times between messages that is their period, even if most messages are lost."""


def usual_period(times: Array) -> float:
    """Return the period in s with which a sensor measures, from the `times` (n,) of its messages; nan if unknown."""
    return float(np.percentile(np.diff(times), USUAL_PERIOD_PERCENTILE)) if len(times) > 1 else float("nan")


def no_values(columns: int) -> TimedValues:
    """Return a signal without samples."""
    return TimedValues(np.empty(0), np.empty((0, columns)), np.empty(0))


@dataclass(frozen=True, eq=False)
class Scans:
    """Scans of one lidar: `ranges` (n, beams) in m, as in sensor_msgs/LaserScan, in the order of measurement.

    Attributes:
        times: Times of measurement (n,) in s.
        arrivals: Times of logging (n,) in s.
        angles: Beam directions (beams,) in the lidar frame in rad.
        range_min: Minimum range in m.
        range_max: Maximum range in m.
        mount: Pose of the lidar on the base.
        height: Height of the lidar above the base frame in m.
        is_malformed: Whether a scan (n,) has another number of beams; its ranges are nan.
        frame: Frame of the lidar.
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
    frame: str = "lidar"

    def __len__(self) -> int:
        return len(self.times)

    @property
    def period(self) -> float:
        """Usual time between two scans in s; nan for fewer than two scans."""
        return float(np.median(np.diff(self.times))) if len(self) > 1 else float("nan")

    def is_hit(self) -> Mask:
        """Return which beams (n, beams) measured an object within the limits of the lidar."""
        with np.errstate(invalid="ignore"):
            hit: Mask = np.isfinite(self.ranges) & (self.ranges >= self.range_min) & (self.ranges <= self.range_max)
            return hit

    def every(self, step: int) -> Scans:
        """Return every second, third, … of the scans."""
        which = slice(None, None, step)
        times, arrivals, ranges, is_malformed = (
            self.times[which],
            self.arrivals[which],
            self.ranges[which],
            self.is_malformed[which],
        )
        limits = self.range_min, self.range_max
        return Scans(times, arrivals, ranges, self.angles, *limits, self.mount, self.height, is_malformed, self.frame)


@dataclass(frozen=True)
class RecordedGoal:
    """Goal of the drive.

    Attributes:
        name: Name, or "" if unknown.
        pose: Pose in the map frame.
        sent: Time in s at which the robot accepted it.
        ended: Time in s of its result; None if it has none.
        status: "reached", "failed", "canceled", "passed" without a stop, or "unknown".
        error: Error code by name, or "".
        source: Topic or estimate that it is from.
    """

    name: str
    pose: Pose2
    sent: float
    ended: float | None = None
    status: str = "unknown"
    error: str = ""
    source: str = ""


@dataclass(frozen=True, eq=False)
class RecordedDrive:
    """Everything that the reconstruction uses of a log.

    Attributes:
        name: Name of the log.
        duration: Time in s of the last message.
        poses: Best known poses of the base in the map frame (x, y, yaw).
        pose_source: Where `poses` are from, for people.
        has_true_poses: Whether `poses` are a ground truth and not the belief of the robot.
        belief: Poses that the localizer published, with the covariances xx, xy, xyaw, yy, yyaw, yawyaw (n, 9).
        corrections: Poses of the odom frame in the map frame (n, 3), from /tf.
        odometry: Poses in the odom frame and velocities vx, vy, wz (n, 6).
        commands: Commanded velocities vx, vy, wz (n, 3).
        turn_rates: Turn rates of the gyroscope about the vertical axis (n, 1), in rad/s.
        bumper: Whether the bumper is pressed (n, 1).
        scans: Scans of the first lidar, or None.
        map: Map of the robot, or None.
        goals: Goals in the order in which they were sent.
        result: Final result of the navigation, such as "SUCCEEDED", or "".
        footprint: Corners of the robot's footprint in the base frame, () if unknown.
        notes: Remarks for the user.
        begin: Time in s, since the start of the log, at which the drive starts.
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
    result: str = ""
    footprint: Polygon = ()
    notes: tuple[str, ...] = ()
    begin: float = 0.0


STEP_S = 0.5
"""Duration of a step."""
MAX_STEP_M = 2.0
"""Longer steps are jumps of the pose, not motion."""


@dataclass(frozen=True, eq=False)
class MotionSteps:
    """Steps of STEP_S that begin at `times` (n,): forward and leftward distance in m, and turn in rad, each (n, 3)."""

    times: Array
    measured: Array
    true: Array
    commanded: Array

    def __len__(self) -> int:
        return len(self.times)


def motion_steps(drive: RecordedDrive) -> MotionSteps:
    """Return the steps of a drive in which odometry and poses are known."""
    odometry, poses = drive.odometry, drive.poses
    if len(odometry) < 2 or len(poses) < 2:
        return MotionSteps(np.empty(0), *(np.empty((0, 3)) for _ in range(3)))
    begin = max(float(odometry.times[0]), float(poses.times[0]))
    end = min(float(odometry.times[-1]), float(poses.times[-1]))
    edges = np.arange(begin, end, STEP_S)
    if len(edges) < 2:
        return MotionSteps(np.empty(0), *(np.empty((0, 3)) for _ in range(3)))
    measured, true = _increments(odometry, edges), _increments(poses, edges)
    commanded = _commanded(drive.commands, edges)
    newest = np.searchsorted(odometry.times, edges[1:], side="right")
    count = newest - np.searchsorted(odometry.times, edges[:-1], side="right")
    kept = (np.hypot(*true[:, :2].T) < MAX_STEP_M) & (count > 0)
    return MotionSteps(edges[:-1][kept], measured[kept], true[kept], commanded[kept])


def _increments(poses: TimedValues, edges: Array) -> Array:
    """Return the motion (n - 1, 3) between poses at `edges` (n,), in the frame in the middle of each step."""
    at = poses.poses_at(edges)
    turn = wrap_array(np.diff(at[:, 2]))
    middle = at[:-1, 2] + turn / 2
    dx, dy = np.diff(at[:, 0]), np.diff(at[:, 1])
    c, s = np.cos(middle), np.sin(middle)
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, turn))


def _commanded(commands: TimedValues, edges: Array) -> Array:
    """Return the motion (n - 1, 3) that held commands make between `edges` (n,)."""
    if not len(commands):
        return np.zeros((len(edges) - 1, 3))
    fine = np.arange(float(edges[0]), float(edges[-1]) + 1e-9, 0.02)
    values = commands.values_at(fine)
    values[fine < commands.times[0]] = 0.0
    totals = np.vstack((np.zeros(3), np.cumsum(values * 0.02, axis=0)))
    return np.diff(totals[np.minimum(np.searchsorted(fine, edges), len(totals) - 1)], axis=0)
