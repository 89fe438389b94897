"""Motion prediction: tracks moving obstacles in the scans of each lidar, and avoids them."""

import math

from simscen.advanced.prediction.avoidance import Avoidance
from simscen.advanced.prediction.followed_path import FollowedPath
from simscen.advanced.prediction.gyro_odometry import GyroOdometry
from simscen.advanced.prediction.stand_position import StandPosition
from simscen.advanced.prediction.tracker import Tracker
from simscen.advanced.prediction.tracks import HIDDEN_TIMEOUT_S
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Path
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Prediction
from simscen.stack.costmap.obstacle_layer import ScanWithMovingHits
from simscen.stack.moving_obstacles import MovingObstacles
from simscen.stack.protocols import CostmapView, RobotModel

WARM_UP_S, WARM_UP_SPEED_M_S = 0.7, 0.5
"""Time after the first scan in which obstacles cannot be tracked yet, and the speed limit during this time."""


class MotionPrediction:
    """Moving obstacles around the robot, and commands that avoid them.

    While the robot drives, `steer` changes the commands. While the robot stands, `stand` lets it step aside and drive
    back to the old position, unless `hold` was called. `on_drive` must be called when the robot drives again.
    """

    def __init__(
        self, spec: Prediction, robot: RobotModel, lidars: tuple[str, ...], tick_rate: int, full_speed: float
    ) -> None:
        """Take the parameters, the robot, the names of its lidars, the tick rate in Hz, and the full speed in m/s."""
        self._spec, self._rate = spec, tick_rate
        self._trackers = {name: Tracker(spec, tick_rate) for name in lidars} if spec.enabled else {}
        self._avoidance = Avoidance(robot, full_speed)
        self._stand_position = StandPosition(robot, full_speed)
        self._warm_up_ticks, self._must_stay = WARM_UP_S * tick_rate, False
        self._max_age_ticks = HIDDEN_TIMEOUT_S * tick_rate
        self._odometry = GyroOdometry(tick_rate)
        self._no_obstacles = MovingObstacles((), spec.acceleration)
        self._active: list[Tracker] = []
        """Trackers with moving obstacles whose lidar has not failed."""
        self._predicted: tuple[int, MovingObstacles] | None = None
        """Cache of `_moving_obstacles`: tick and result."""
        self._transformed: tuple[MovingObstacles, Pose2, Pose2, MovingObstacles] | None = None
        """Cache of `moving_obstacles_in_frame`: obstacles, pose by odometry, `pose`, and result."""
        self._plan: Path | None = None
        self._followed: FollowedPath | None = None
        self.add_reading = self._odometry.add
        """Process an odometry or IMU reading."""
        self.is_idle = not self._trackers
        """Whether no obstacle moves and the warm-up is over, so that `steer` changes no command."""

    def on_scan(self, scan: Scan) -> None:
        """Update the tracks of the lidar that took a scan."""
        tracker = self._trackers.get(scan.sensor)
        if tracker is None:
            return
        tracker.on_scan(scan, self._odometry.at(scan.tick))
        self._predicted = None
        if self.is_idle and not tracker.has_moving_obstacles:
            return
        self._active = [
            each
            for each in self._trackers.values()
            if each.has_moving_obstacles and scan.tick - each.tick <= self._max_age_ticks
        ]
        self.is_idle = not self._active and all(
            each.first_tick is not None and scan.tick - each.first_tick >= self._warm_up_ticks
            for each in self._trackers.values()
        )
        if not self._active:
            self._avoidance.reset()

    def with_moving_hits(self, scan: Scan) -> Scan:
        """Return the scan with a mask of its hits on moving obstacles, if any. Costmaps do not mark these hits."""
        tracker = self._trackers.get(scan.sensor)
        if tracker is None or tracker.moving_hits is None or tracker.tick != scan.tick:
            return scan
        return ScanWithMovingHits(**vars(scan), moving=tracker.moving_hits)

    def _moving_obstacles(self, tick: int) -> MovingObstacles:
        """Return the moving obstacles at a tick in the frame of GyroOdometry, from all lidars."""
        if not self._active:
            return self._no_obstacles
        if self._predicted is None or self._predicted[0] != tick:
            predicted = [tracker.moving.after((tick - tracker.tick) / self._rate) for tracker in self._active]
            obstacles = [obstacle for each in predicted for obstacle in each.obstacles]
            self._predicted = tick, MovingObstacles(obstacles, self._spec.acceleration)
        return self._predicted[1]

    def moving_obstacles_in_frame(self, tick: int, pose: Pose2) -> MovingObstacles:
        """Return the moving obstacles at a tick in the frame in which the robot is at `pose` now."""
        moving = self._moving_obstacles(tick)
        if not moving.obstacles:
            return moving
        now, cached = self._odometry.now, self._transformed
        if cached is None or cached[0] is not moving or cached[1] is not now or cached[2] is not pose:
            self._transformed = cached = moving, now, pose, moving.in_frame(now.compose(pose.inverse()))
        return cached[3]

    def steer(
        self,
        tick: int,
        command: Twist,
        pose: Pose2,
        twist: Twist,
        costmap: CostmapView,
        plan: Path | None,
        max_speed: float,
    ) -> Twist:
        """Return `command`, or a command that avoids moving obstacles. `pose`, `costmap`, and `plan` share a frame.

        `max_speed` is the limit in m/s of speed zones and masks.
        """
        if not self._active:
            return command if self.is_idle else _limit_speed(command, WARM_UP_SPEED_M_S)
        if plan is not self._plan:
            self._plan, self._followed = plan, None if plan is None else FollowedPath(plan.points)
        moving = self.moving_obstacles_in_frame(tick, pose)
        return self._avoidance.steer(command, pose, twist, moving, costmap, self._followed, max_speed=max_speed)

    def on_drive(self) -> None:
        """Forget the position to which a standing robot returns, because the robot drives now."""
        self._stand_position.clear()
        self._must_stay = False

    def hold(self) -> None:
        """Stay in place until the robot drives again, even if an obstacle approaches."""
        self._must_stay = True

    def stand(self, tick: int, pose: Pose2, twist: Twist, costmap: CostmapView, max_speed: float) -> Twist:
        """Return the command for a standing robot: step aside for moving obstacles, or drive back, or stop.

        `max_speed` is the limit in m/s of speed zones and masks.
        """
        if self._must_stay:
            return STOP
        home = self._stand_position.remember(pose, bool(self._active))
        if home is None:
            return STOP
        command = _limit_speed(self._stand_position.return_command(pose), max_speed)
        if not self._active:
            return command
        moving = self.moving_obstacles_in_frame(tick, pose)
        return self._avoidance.steer(command, pose, twist, moving, costmap, None, home, max_speed)


def _limit_speed(command: Twist, max_speed: float) -> Twist:
    """Return the command with at most this speed in m/s, and the same curvature."""
    speed = math.hypot(command.vx, command.vy)
    if speed <= max_speed:
        return command
    scale = max_speed / speed
    return Twist(scale * command.vx, scale * command.vy, scale * command.wz)
