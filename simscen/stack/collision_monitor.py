"""The last word before the base: nav2_collision_monitor on the raw scan, knowing nothing of map or costmap.

What motion prediction tells of things that move is met where both will be: APPROACH by the relative velocity.
"""

import math
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.sensor_data import Scan
from simscen.model.guards import CollisionMonitor as MonitorSpec
from simscen.stack.arcs import poses_along
from simscen.stack.costmap.obstacle_layer import ScanAmongMoving
from simscen.stack.moving_obstacles import MovingObstacles, no_moving_obstacles
from simscen.stack.protocols import RobotModel

SAMPLES = 8
"""Moments within the prediction at which the hull is compared with the scan."""
ORIGIN = Pose2(0.0, 0.0)
MIN_APPROACH_M = 0.005
"""Meters by which something that moves must come nearer than to a robot that stood, for braking to help."""
ROUNDING_M = 1e-6
"""Meters: who is that near to coming near has his hull looked at."""


@dataclass(frozen=True, eq=False)
class RecordedScan:
    """The newest scan of a lidar: taken at `odometry`, with nothing nearer to the base than `nearest` meters."""

    scan: Scan
    odometry: Pose2
    nearest: float


class CollisionMonitor:
    """Stops when a lidar is silent; slows down (APPROACH) or stops (STOP) before what the newest scan shows."""

    def __init__(self, spec: MonitorSpec, robot: RobotModel, lidars: tuple[str, ...], tick_rate: int) -> None:
        self._spec, self._robot = spec, robot
        self._timeout, self._tick_rate = round(spec.source_timeout * tick_rate), tick_rate
        self._came: dict[str, tuple[int, int]] = {}
        self.hold_ticks = spec.hold_timeout * tick_rate or math.inf
        """For how long it may allow nothing until that is a failure."""
        self._seen, self._oldest, self._began = dict.fromkeys(lidars, -math.inf), -math.inf, 0
        self._scans: dict[str, RecordedScan] = {}
        self._moving, self._moves = no_moving_obstacles(), False
        corners = np.array(robot.footprint, dtype=np.float64)
        ends = np.roll(corners, -1, axis=0)
        normal = np.column_stack((ends[:, 1] - corners[:, 1], corners[:, 0] - ends[:, 0]))
        self._times = np.linspace(0.0, spec.time_before_collision, SAMPLES + 1)
        self._near = robot.circumscribed_radius + spec.stop_margin
        self._normal = normal / np.hypot(normal[:, 0], normal[:, 1])[:, None]
        self._offset = np.sum(self._normal * corners, axis=1)
        self._half, self._mitre = float(self._offset.max()), _mitre(self._normal)
        if robot.radius is not None:
            self._half, self._mitre = robot.radius, 1.0

    def start(self, tick: int) -> None:
        """A lidar that nobody has heard yet is silent, and has been since now."""
        self._began = tick

    def on_scan(self, scan: Scan, odometry: Pose2, tick: int = 0) -> None:
        """A scan that came at `tick`, and where odometry was; one in which no beam answers is silence."""
        self._came[scan.sensor] = tick, scan.tick
        nearest = _nearest(scan)
        if nearest is None:
            return
        self._seen[scan.sensor] = scan.tick
        self._oldest = min(self._seen.values())
        self._scans[scan.sensor] = RecordedScan(scan, odometry, nearest - math.hypot(scan.mount.x, scan.mount.y))

    def on_moving(self, moving: MovingObstacles) -> None:
        """What moves around the robot now, in its base frame; beams that hit it are left to this."""
        self._moving, self._moves = moving, len(moving) > 0

    def silent(self, tick: int) -> bool:
        """Whether a lidar has not been heard for `source_timeout`, or not at all: nobody drives off blind."""
        return tick - self._oldest > self._timeout and self._spec.enabled and bool(self._seen)

    def silence(self, tick: int) -> str:
        """Why the lidar that was heard longest ago is taken for silent."""
        name = min(self._seen, key=lambda sensor: self._seen[sensor])
        limit, ago = f"source_timeout is {self._spec.source_timeout:g} s", self._since(name, tick)
        came, taken = self._came.get(name, (None, 0))
        if came is None or (tick - came) > self._timeout:
            return f"lidar `{name}` has been silent for {ago:.2f} s; {limit}"
        if taken != self._seen[name]:
            return f"lidar `{name}` has been blind for {ago:.2f} s, as no beam of its scans answers; {limit}"
        late = (came - taken) / self._tick_rate
        return f"scans of lidar `{name}` are {late:.2f} s old when they come; {limit}"

    def _since(self, name: str, tick: int) -> float:
        """For how many seconds the lidar has been silent."""
        return (tick - max(self._seen[name], self._began)) / self._tick_rate

    def allow(self, wanted: Twist, odometry: Pose2) -> Twist:
        """The command, slowed down so that the first contact is at least `time_before_collision` away."""
        if not self._spec.enabled or wanted == STOP:
            return wanted
        free = horizon = self._spec.time_before_collision
        for seen in self._scans.values():
            free = min(free, self._time_free(seen, wanted, odometry, horizon))
        if self._moves and self._comes_near(wanted, horizon):
            free = min(free, self._time_unmet(wanted, horizon))
        if free >= horizon:
            return wanted
        scale = free / horizon
        return Twist(wanted.vx * scale, wanted.vy * scale, wanted.wz * scale) if scale > 0.0 else STOP

    def _time_free(self, seen: "RecordedScan", wanted: Twist, odometry: Pose2, horizon: float) -> float:
        """Seconds until a point of the scan would be within the stop margin; points it moves away from are no harm."""
        (vx, vy, _), (x, y, _), (then_x, then_y, _) = wanted, odometry, seen.odometry
        reach = self._near + math.hypot(vx, vy) * horizon + math.hypot(x - then_x, y - then_y)
        if seen.nearest > reach:
            return horizon
        moved = seen.odometry.between(odometry)
        points = moved.inverse().apply(_points_within(seen.scan, reach))
        if not len(points):
            return horizon
        times = self._times
        gap = self._gaps(points[None], poses_along(ORIGIN, wanted, times))
        now, least = gap[0], self._spec.stop_margin
        touched = (gap[1:] < least) & (gap[1:] < now - 1e-4)
        when = touched.sum(axis=1) >= self._spec.min_points
        return float(times[int(when.argmax())]) if when.any() else horizon

    def _comes_near(self, wanted: Twist, horizon: float) -> bool:
        """Whether anything that moves can be within the stop margin of the hull by then: rarely, and soon told.

        On a straight way the nearest moment is known in closed form; a bend leads off it by no more than `bent`.
        """
        going = complex(wanted.vx, wanted.vy)
        bent = abs(going) * abs(wanted.wz) * horizon * horizon / 2
        margin = self._spec.stop_margin
        for place, velocity, radius, *_ in self._moving.things:
            towards = velocity - going
            square = towards.real * towards.real + towards.imag * towards.imag
            when = -(place * towards.conjugate()).real / square if square > 0.0 else 0.0
            near = abs(place + min(max(when, 0.0), horizon) * towards) - bent
            if near <= (self._half + radius + margin) * self._mitre + ROUNDING_M:
                return True
        return False

    def _time_unmet(self, wanted: Twist, horizon: float) -> float:
        """Seconds until something that moves would be within the stop margin of the hull, both on their ways.

        The whole horizon where a robot that stood would be met as soon and as closely: to brake for that is no help.
        """
        times = self._times
        centers = self._moving.at(times)
        gaps = self._gaps_to(centers, wanted)
        met = (gaps[1:] < 0.0) & (gaps[1:] < gaps[0] - 1e-4)
        if not met.any():
            return horizon
        standing = self._gaps_to(centers, STOP)
        anyway = (standing[1:] < 0.0) & (standing[1:] < standing[0] - 1e-4)
        first = (met | anyway).argmax(axis=0)  # of each thing, the moment that tells which of the two is worse
        worse = (gaps < standing - MIN_APPROACH_M)[1 + first, np.arange(len(first))]
        when = (met & worse).any(axis=1)
        return float(times[int(when.argmax())]) if when.any() else horizon

    def _gaps_to(self, centers: Array, twist: Twist) -> Array:
        """How far (times, things) what moves is from the stop margin when the robot goes with `twist`."""
        return self._gaps(centers, poses_along(ORIGIN, twist, self._times)) - (
            self._moving.radii + self._spec.stop_margin
        )

    def _gaps(self, points: Array, poses: Array) -> Array:
        """Distance (poses, n) from the hull's edge at each pose to points (poses or 1, n, 2); negative inside.

        For a polygon it is the distance to the farthest of its edge lines, which is never more than the true one.
        """
        dx = points[:, :, 0] - poses[:, None, 0]
        dy = points[:, :, 1] - poses[:, None, 1]
        if self._robot.radius is not None:
            return np.hypot(dx, dy) - self._robot.radius
        cosine, sine = np.cos(poses[:, None, 2]), np.sin(poses[:, None, 2])
        body = np.stack((cosine * dx + sine * dy, cosine * dy - sine * dx), axis=-1)
        gaps: Array = (body @ self._normal.T - self._offset).max(axis=-1)
        return gaps


def _mitre(normals: Array) -> float:
    """How many meters from the middle something may be at most that is less than a meter beyond each of these lines.

    They have the `normals` (n, 2), and it is farthest off between the two that lie widest apart.
    """
    angles = np.sort(np.arctan2(normals[:, 1], normals[:, 0]))
    return float(1.0 / np.cos(np.diff(angles, append=angles[0] + math.tau).max() / 2))


def _nearest(scan: Scan) -> float | None:
    """Meters to the nearest thing that a beam answers; None where none does."""
    nearest = float(np.fmin.reduce(scan.ranges, initial=math.inf))
    if nearest >= scan.range_min and nearest < math.inf:
        return nearest
    answers = scan.ranges[scan.ranges >= scan.range_min]
    return float(answers.min()) if len(answers) else None


def _points_within(scan: Scan, reach: float) -> Array:
    """The hits (n, 2) at most `reach` meters from the base, in its frame; few of a scan, so little to compute."""
    most = reach + math.hypot(scan.mount.x, scan.mount.y)
    hits = (scan.ranges >= scan.range_min) & (scan.ranges <= min(most, scan.range_max))
    near = np.flatnonzero(hits & ~scan.moving if isinstance(scan, ScanAmongMoving) else hits)
    angles, ranges = scan.angle_min + scan.angle_increment * near, scan.ranges[near]
    return scan.mount.apply(np.column_stack((ranges * np.cos(angles), ranges * np.sin(angles))))
