"""Motion prediction: trackers for the lidars, and avoidance of the tracked obstacles."""

import math

from simscen.advanced.prediction.avoidance import Avoidance, StandPosition
from simscen.advanced.prediction.dead_reckoning import DeadReckoning
from simscen.advanced.prediction.rollouts import FollowedPath
from simscen.advanced.prediction.tracker import Tracker
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Path
from simscen.core.messages.sensor_data import Scan
from simscen.model.guards import Prediction
from simscen.stack.costmap.obstacle_layer import ScanWithMovingHits
from simscen.stack.moving_obstacles import MovingObstacles, no_moving_obstacles
from simscen.stack.protocols import CostmapView, RobotModel

WARM_UP_S, WARM_UP_SPEED_M_S = 0.7, 0.5
"""Time after the first scan in which obstacles cannot be tracked yet, and the speed limit during that time: Nav2's
usual speed, at which the robot can still stop for obstacles."""


class MotionPrediction:
    """Moving obstacles around the robot, and commands that avoid them. Tracks are in the frame of DeadReckoning."""

    def __init__(
        self, spec: Prediction, robot: RobotModel, lidars: tuple[str, ...], tick_rate: int, full_speed: float
    ) -> None:
        """Take the parameters, the robot, the names of its lidars, the tick rate in Hz, and the full speed in m/s."""
        self._spec, self._rate = spec, tick_rate
        self._trackers = {name: Tracker(spec, tick_rate) for name in lidars} if spec.enabled else {}
        self._avoidance = Avoidance(spec, robot, full_speed)
        self._standing = StandPosition(robot, full_speed)
        self._enough, self._held = WARM_UP_S * tick_rate, False
        self.stands = False
        """Whether the robot was asked to stand since it last drove."""
        self._rolled = DeadReckoning(tick_rate)
        self._nothing = no_moving_obstacles(spec.acceleration)
        self._seeing: list[Tracker] = []
        self._foretold: tuple[int, MovingObstacles] | None = None
        self._told: tuple[MovingObstacles, Pose2, Pose2, MovingObstacles] | None = None
        self._plan: Path | None = None
        self._followed: FollowedPath | None = None
        self.take = self._rolled.take
        """Process an odometry or IMU reading."""
        self.calm = not self._trackers
        """Whether no obstacle moves and the warm-up is over, so that no command is changed."""

    def on_scan(self, scan: Scan) -> None:
        """Process a scan."""
        tracker = self._trackers.get(scan.sensor)
        if tracker is None:
            return
        tracker.on_scan(scan, self._rolled.at(scan.tick))
        self._foretold = None
        if self.calm and not tracker.sees:
            return
        self._seeing = [each for each in self._trackers.values() if each.sees]
        self.calm = not self._seeing and all(
            each.began is not None and scan.tick - each.began >= self._enough for each in self._trackers.values()
        )
        if not self._seeing:
            self._avoidance.rest()

    def marking(self, scan: Scan) -> Scan:
        """Return the scan for costmaps, in which hits on moving obstacles are flagged so that they are not marked."""
        tracker = self._trackers.get(scan.sensor)
        if tracker is None or tracker.hits is None or tracker.tick != scan.tick:
            return scan
        return ScanWithMovingHits(**vars(scan), moving=tracker.hits)

    def moving(self, tick: int) -> MovingObstacles:
        """Return the moving obstacles at a tick in the frame of DeadReckoning, from all lidars."""
        if not self._seeing:
            return self._nothing
        if self._foretold is None or self._foretold[0] != tick:
            self._foretold = tick, self._after(tick)
        return self._foretold[1]

    def _after(self, tick: int) -> MovingObstacles:
        seen = [tracker.moving.after((tick - tracker.tick) / self._rate) for tracker in self._seeing]
        return MovingObstacles.of([thing for each in seen for thing in each.things], self._spec.acceleration)

    def seen_from(self, tick: int, pose: Pose2) -> MovingObstacles:
        """Return the moving obstacles at a tick in a frame in which the robot is at `pose` now."""
        moving = self.moving(tick)
        if not moving.things:
            return moving
        now, told = self._rolled.now, self._told
        if told is None or told[0] is not moving or told[1] is not now or told[2] is not pose:
            self._told = told = moving, now, pose, moving.seen_from(now.compose(pose.inverse()))
        return told[3]

    def steer(
        self, tick: int, wanted: Twist, pose: Pose2, twist: Twist, costmap: CostmapView, plan: Path | None
    ) -> Twist:
        """Return the command to send instead of `wanted`; `pose`, `costmap`, and `plan` are in one frame."""
        if not self._seeing:
            return wanted if self.calm else _limit_speed(wanted)
        if plan is not self._plan:
            self._plan, self._followed = plan, None if plan is None else FollowedPath(plan.points)
        return self._avoidance.steer(wanted, pose, twist, self.seen_from(tick, pose), costmap, self._followed)

    def settle(self) -> None:
        """Record that the robot drives, so that it gets a new stand position afterward."""
        self._standing.leave()
        self._held = self.stands = False

    def hold(self) -> None:
        """Stay in place until the robot drives again, even if an obstacle approaches."""
        self._held = self.stands = True

    def stand(self, tick: int, pose: Pose2, twist: Twist, costmap: CostmapView) -> Twist:
        """Return the command for a standing robot: step aside for obstacles, and return afterward."""
        self.stands = True
        if self._held:
            return STOP
        home = self._standing.home(pose, bool(self._seeing))
        if home is None:
            return STOP
        wanted = self._standing.back(pose)
        if not self._seeing:
            return wanted
        return self._avoidance.steer(wanted, pose, twist, self.seen_from(tick, pose), costmap, None, home)


def _limit_speed(wanted: Twist) -> Twist:
    """Return the command with the speed limit of the warm-up."""
    speed = math.hypot(wanted.vx, wanted.vy)
    if speed <= WARM_UP_SPEED_M_S:
        return wanted
    scale = WARM_UP_SPEED_M_S / speed
    return Twist(scale * wanted.vx, scale * wanted.vy, scale * wanted.wz)
