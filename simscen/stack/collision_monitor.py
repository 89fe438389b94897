"""Collision monitor (nav2_collision_monitor): slows the robot down before obstacles in the latest scans.

The monitor does not use map or costmaps. If the stack predicts moving obstacles, the monitor uses the predictions.
"""

import math
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.sensor_data import Scan
from simscen.model.velocity_commands import CollisionMonitor as MonitorSpec
from simscen.stack.costmap.obstacle_layer import ScanWithMovingHits
from simscen.stack.kinematics import poses_along
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES, MovingObstacles
from simscen.stack.protocols import RobotModel

DEFAULT_STEPS = 8
"""Number of time steps until `time_before_collision` if `simulation_time_step` is not set."""
STEP_TOLERANCE = 1e-9
"""A remainder of the division into time steps up to this fraction of a step is a rounding error, and adds no step."""
MAX_STEPS = 1000
"""Maximum number of time steps, so that a tiny `simulation_time_step` cannot exhaust the memory."""
ORIGIN = Pose2(0.0, 0.0)
"""Current pose of the robot in the base frame."""
MIN_BENEFIT_M = 0.005
"""The robot brakes for a moving obstacle only if braking increases the distance to the obstacle by more than this."""
ROUNDING_M = 1e-6
"""Rounding error allowed for distances to moving obstacles."""


@dataclass(frozen=True, eq=False)
class RecordedScan:
    """The latest scan of a lidar.

    odometry:  pose of the robot in the odom frame at the time of the scan
    nearest:   lower bound in m on the distance from the base to any hit
    """

    scan: Scan
    odometry: Pose2
    nearest: float


class CollisionMonitor:
    """Slows the robot down before obstacles (Nav2's "approach" action), and detects lidars without usable scans."""

    def __init__(self, spec: MonitorSpec, robot: RobotModel, lidars: tuple[str, ...], tick_rate: int) -> None:
        self._spec, self._robot = spec, robot
        self._timeout, self._tick_rate = round(spec.source_timeout * tick_rate), tick_rate
        self._arrivals: dict[str, tuple[int, int]] = {}
        """For each lidar, the tick at which its latest message arrived and the tick of the scan."""
        self.hold_ticks = spec.hold_timeout * tick_rate or math.inf
        """Time in ticks after which stopping the robot counts as a failure; inf if disabled."""
        self._scan_ticks = dict.fromkeys(lidars, -math.inf)
        """Tick of the latest usable scan of each lidar."""
        self._oldest, self._start_tick = -math.inf, 0
        """Minimum of `_scan_ticks`, and the tick at which the task started."""
        self._scans: dict[str, RecordedScan] = {}
        """Latest usable scan of each lidar."""
        self._moving, self._has_moving = NO_MOVING_OBSTACLES, False
        corners = np.array(robot.footprint, dtype=np.float64)
        ends = np.roll(corners, -1, axis=0)
        normal = np.column_stack((ends[:, 1] - corners[:, 1], corners[:, 0] - ends[:, 0]))
        steps = DEFAULT_STEPS
        if spec.simulation_time_step is not None:
            steps = math.ceil(spec.time_before_collision / spec.simulation_time_step - STEP_TOLERANCE)
        self._times = np.linspace(0.0, spec.time_before_collision, min(MAX_STEPS, steps) + 1)
        """Times in s from now at which the motion is simulated."""
        self._stop_radius = robot.circumscribed_radius + spec.stop_margin
        self._normal = normal / np.hypot(normal[:, 0], normal[:, 1])[:, None]
        self._offset = np.sum(self._normal * corners, axis=1)
        """Outward unit normals (n, 2) of the footprint's edges, and distances (n,) of the edges from the base."""
        self._max_edge_distance, self._miter_factor = float(self._offset.max()), _miter_factor(self._normal)
        if robot.radius is not None:
            self._max_edge_distance, self._miter_factor = robot.radius, 1.0

    def start(self, tick: int) -> None:
        """Set the start of the task, from which `silence_reason` counts the time without a first scan."""
        self._start_tick = tick

    def on_scan(self, scan: Scan, odometry: Pose2, tick: int = 0) -> None:
        """Store a scan that arrived at `tick`, if it is usable: not all ranges are invalid or too short.

        `odometry` is the pose of the robot in the odom frame when the scan was taken.
        """
        self._arrivals[scan.sensor] = tick, scan.tick
        nearest = _shortest_range(scan)
        if nearest is None:
            return
        self._scan_ticks[scan.sensor] = scan.tick
        self._oldest = min(self._scan_ticks.values())
        self._scans[scan.sensor] = RecordedScan(scan, odometry, nearest - math.hypot(scan.mount.x, scan.mount.y))

    def set_moving_obstacles(self, moving: MovingObstacles) -> None:
        """Set the moving obstacles in the base frame. Scans must mark their hits (ScanWithMovingHits)."""
        self._moving, self._has_moving = moving, len(moving) > 0

    def is_silent(self, tick: int) -> bool:
        """Return whether the last usable scan of some lidar is older than `source_timeout`; False if disabled."""
        return tick - self._oldest > self._timeout and self._spec.enabled and bool(self._scan_ticks)

    def silence_reason(self, tick: int) -> str:
        """Return a message that names the silent lidar, and states whether its scans are missing, empty, or late."""
        name = min(self._scan_ticks, key=lambda sensor: self._scan_ticks[sensor])
        limit = f"source_timeout is {self._spec.source_timeout:g} s"
        elapsed = (tick - max(self._scan_ticks[name], self._start_tick)) / self._tick_rate
        arrived, taken = self._arrivals.get(name, (None, 0))
        if arrived is None or (tick - arrived) > self._timeout:
            return f"lidar `{name}` has been silent for {elapsed:.2f} s; {limit}"
        if taken != self._scan_ticks[name]:
            return f"lidar `{name}` has been blind for {elapsed:.2f} s: its scans contain no returns; {limit}"
        delay = (arrived - taken) / self._tick_rate
        return f"scans of lidar `{name}` are {delay:.2f} s old when they arrive; {limit}"

    def limit_command(self, command: Twist, odometry: Pose2) -> Twist:
        """Return the command, scaled down if it leads to a collision within `time_before_collision` s.

        `odometry` is the current pose in the odom frame.
        """
        if not self._spec.enabled or command == STOP:
            return command
        free_time = horizon = self._spec.time_before_collision
        for recorded in self._scans.values():
            free_time = min(free_time, self._time_to_scan_points(recorded, command, odometry, horizon))
        if self._has_moving and self._may_meet_moving(command, horizon):
            free_time = min(free_time, self._time_to_moving(command, horizon))
        if free_time >= horizon:
            return command
        scale = free_time / horizon
        return Twist(command.vx * scale, command.vy * scale, command.wz * scale) if scale > 0.0 else STOP

    def _time_to_scan_points(self, recorded: RecordedScan, command: Twist, odometry: Pose2, horizon: float) -> float:
        """Return the time in s until `min_points` hits of a scan are within the stop margin, at most `horizon`.

        Hits that the robot moves away from do not count.
        """
        (vx, vy, _), (x, y, _), (scan_x, scan_y, _) = command, odometry, recorded.odometry
        reach = self._stop_radius + math.hypot(vx, vy) * horizon + math.hypot(x - scan_x, y - scan_y)
        if recorded.nearest > reach:
            return horizon
        motion = recorded.odometry.between(odometry)
        points = motion.inverse().apply(_points_within(recorded.scan, reach))
        if not len(points):
            return horizon
        times = self._times
        gap = self._footprint_gaps(points[None], poses_along(ORIGIN, command, times))
        current, margin = gap[0], self._spec.stop_margin
        collides = (gap[1:] < margin) & (gap[1:] < current - 1e-4)
        is_contact = collides.sum(axis=1) >= self._spec.min_points
        return float(times[int(is_contact.argmax())]) if is_contact.any() else horizon

    def _may_meet_moving(self, command: Twist, horizon: float) -> bool:
        """Return whether a moving obstacle may come within the stop margin of the footprint within `horizon` s.

        This quick check returns False only if it is certain. It uses the closest approach of straight motions, and an
        upper bound on the effect of the turn rate.
        """
        robot_velocity = complex(command.vx, command.vy)
        deviation = abs(robot_velocity) * abs(command.wz) * horizon * horizon / 2
        margin = self._spec.stop_margin
        for position, velocity, radius, *_ in self._moving.obstacles:
            relative = velocity - robot_velocity
            square = relative.real * relative.real + relative.imag * relative.imag
            time = -(position * relative.conjugate()).real / square if square > 0.0 else 0.0
            closest = abs(position + min(max(time, 0.0), horizon) * relative) - deviation
            if closest <= (self._max_edge_distance + radius + margin) * self._miter_factor + ROUNDING_M:
                return True
        return False

    def _time_to_moving(self, command: Twist, horizon: float) -> float:
        """Return the time in s until a moving obstacle is within the stop margin of the footprint, at most `horizon`.

        Obstacles that come as close to a stationary robot do not count, because braking does not help.
        """
        times = self._times
        centers = self._moving.at(times)
        gaps = self._moving_gaps(centers, command)
        collides = (gaps[1:] < 0.0) & (gaps[1:] < gaps[0] - 1e-4)
        if not collides.any():
            return horizon
        gaps_standing = self._moving_gaps(centers, STOP)
        unavoidable = (gaps_standing[1:] < 0.0) & (gaps_standing[1:] < gaps_standing[0] - 1e-4)
        first = (collides | unavoidable).argmax(axis=0)  # time step at which driving and standing are compared
        is_closer = (gaps < gaps_standing - MIN_BENEFIT_M)[1 + first, np.arange(len(first))]
        is_contact = (collides & is_closer).any(axis=1)
        return float(times[int(is_contact.argmax())]) if is_contact.any() else horizon

    def _moving_gaps(self, centers: Array, twist: Twist) -> Array:
        """Return distances (times, obstacles) in m from the edge of the stop margin to moving obstacles.

        The robot moves with a constant `twist`. `centers` (times, obstacles, 2) are the predicted obstacle positions.
        """
        return self._footprint_gaps(centers, poses_along(ORIGIN, twist, self._times)) - (
            self._moving.radii + self._spec.stop_margin
        )

    def _footprint_gaps(self, points: Array, poses: Array) -> Array:
        """Return distances (k, n) in m from the footprint at poses (k, 3) to points (k or 1, n, 2); negative inside.

        For a polygon, the result is a lower bound: the largest signed distance from the lines through its edges.
        """
        dx = points[:, :, 0] - poses[:, None, 0]
        dy = points[:, :, 1] - poses[:, None, 1]
        if self._robot.radius is not None:
            return np.hypot(dx, dy) - self._robot.radius
        cosine, sine = np.cos(poses[:, None, 2]), np.sin(poses[:, None, 2])
        body = np.stack((cosine * dx + sine * dy, cosine * dy - sine * dx), axis=-1)
        gaps: Array = (body @ self._normal.T - self._offset).max(axis=-1)
        return gaps


def _miter_factor(normals: Array) -> float:
    """Return the miter factor of a convex polygon with the outward unit normals (n, 2) of its edges.

    A point p with n · p <= d for all normals n is at most d times this factor away from the origin.
    """
    angles = np.sort(np.arctan2(normals[:, 1], normals[:, 0]))
    return float(1.0 / np.cos(np.diff(angles, append=angles[0] + math.tau).max() / 2))


def _shortest_range(scan: Scan) -> float | None:
    """Return the shortest valid range in m (inf without hits); None if all ranges are invalid or too short."""
    nearest = float(np.fmin.reduce(scan.ranges, initial=math.inf))
    if nearest >= scan.range_min and nearest < math.inf:
        return nearest
    returns = scan.ranges[scan.ranges >= scan.range_min]
    return float(returns.min()) if len(returns) else None


def _points_within(scan: Scan, reach: float) -> Array:
    """Return hits (n, 2) on static obstacles in the base frame: all within `reach` m, and some farther away."""
    max_range = reach + math.hypot(scan.mount.x, scan.mount.y)
    hits = (scan.ranges >= scan.range_min) & (scan.ranges <= min(max_range, scan.range_max))
    beams = np.flatnonzero(hits & ~scan.moving if isinstance(scan, ScanWithMovingHits) else hits)
    angles, ranges = scan.angle_min + scan.angle_increment * beams, scan.ranges[beams]
    return scan.mount.apply(np.column_stack((ranges * np.cos(angles), ranges * np.sin(angles))))
