"""Regulated pure pursuit (Macenski et al. 2023; nav2_regulated_pure_pursuit_controller)."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.motion import STOP, Twist
from simscen.core.navigation import ErrorCode, Goal, Path
from simscen.model.controllers import RegulatedPurePursuit as RppSpec
from simscen.stack.arcs import poses_along
from simscen.stack.controllers.goal_pose import GoalPose
from simscen.stack.controllers.tracking import AT_CUSP, PathTracker
from simscen.stack.controllers.turning import TurningRoom
from simscen.stack.footprint import distance_at
from simscen.stack.lookahead import time_free
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

DEFAULT_SPEED = 0.5
"""Nav2's desired_linear_vel."""
SHOWN: Array = np.arange(16, dtype=np.float64) * 0.1
"""Seconds of the arc that `local_plan` shows."""
CREEP = 0.1
"""m/s. When only slower than this would keep the time to collision, the way is blocked."""
BEND = 0.4
"""Of its turning radius a car looks ahead at most: its plans go from full left to full right, and what a chord cuts off
there it cannot make good again."""
NEARER = (1.0, 0.7, 0.5, 0.35)
"""Parts of the look-ahead distance that are tried until the arc is free: an arc to a far carrot cuts the path's bends,
shorter ones keep to it. nav2_graceful_controller goes through its targets likewise."""


class RegulatedPurePursuit:
    """Steers at a carrot on the path and regulates its speed by curvature, nearness of obstacles and of the goal."""

    def __init__(self, spec: RppSpec, setting: Setting) -> None:
        robot, footprint, period = setting.robot, setting.footprint, setting.control_period
        self._spec, self._robot, self._footprint = spec, robot, footprint
        self._desired = min(spec.desired_linear_vel or DEFAULT_SPEED, robot.max_linear)
        self._goal_pose = GoalPose(robot, spec.rotate_to_heading_angular_vel, spec.max_angular_accel, period)
        self._turning = TurningRoom(footprint)
        self._limit: float | None = None
        self._track: PathTracker | None = None
        self._arc: tuple[Pose2, Twist] | None = None

    def set_path(self, path: Path) -> None:
        """Follow this path from now on."""
        if not len(path.points):
            raise NavigationFailure(ErrorCode.INVALID_PATH, "the path has no points")
        self._track = PathTracker(path)
        self._goal_pose.reset()

    @property
    def full_speed(self) -> float:
        """What it drives at in m/s where nothing limits it."""
        return self._desired

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than this in m/s; None lifts the limit."""
        self._limit = limit

    @property
    def local_plan(self) -> Path | None:
        """The arc it expects to drive in the next second and a half."""
        if self._arc is None:
            return None
        return Path(poses_along(*self._arc, SHOWN))

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """The velocity to drive now. Raises NO_VALID_CONTROL when the arc to the carrot is blocked."""
        if self._track is None:
            raise NavigationFailure(ErrorCode.INVALID_PATH, "there is no path to follow")
        track = self._track
        track.locate(pose)
        if self._goal_pose.reached(pose, twist, goal, track.remaining()):
            angle = wrap(goal.pose.yaw - pose.yaw)
            command = self._turn(angle, pose, twist, costmap) if self._robot.turning_radius == 0.0 else STOP
        else:
            command = self._follow(track, pose, twist, costmap)
        self._arc = (pose, command)
        return command

    def _follow(self, track: PathTracker, pose: Pose2, twist: Twist, costmap: CostmapView) -> Twist:
        """To the farthest carrot that can be reached freely; if none can, on the arc that is free for longest."""
        reach = self._lookahead(twist.vx)
        arcs: list[tuple[float, float, Twist]] = []
        turn: float | None = None
        for part in NEARER:
            if part < 1.0 and part * reach < self._spec.min_lookahead_dist:
                break
            carrot = _seen_from(pose, *track.carrot(pose, part * reach, beyond=self._robot.turning_radius > 0.0))
            if self._should_rotate(carrot):
                turn = self._bearing(carrot)
                break
            command = self._drive(carrot, pose, costmap)
            free, horizon = self._time_free(command, pose, costmap, self._as_far_as(carrot))
            if free >= horizon:
                return command
            arcs.append((free, horizon, command))
        if turn is not None:
            return self._turn(turn, pose, twist, costmap)
        free, horizon, command = max(arcs, key=lambda arc: arc[0])
        return self._within_free_way(command, free, horizon)

    def _as_far_as(self, carrot: tuple[float, float]) -> float:
        """Metres for which the way must be free: to the carrot; of a car's, that may lie beyond where it stops."""
        assert self._track is not None
        away = math.hypot(*carrot)
        return min(away, max(AT_CUSP, self._track.to_cusp())) if self._robot.turning_radius > 0.0 else away

    def _turn(self, angle: float, pose: Pose2, twist: Twist, costmap: CostmapView) -> Twist:
        """In place where there is room for all of the turn; else back out to where there is."""
        if not self._spec.use_collision_detection or self._turning.has_room(angle, pose, costmap):
            return self._goal_pose.turn(angle, twist)
        back = self._turning.back_out(pose, costmap)
        if back is None:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "no room to turn, nor to back out")
        return back

    def _lookahead(self, speed: float) -> float:
        spec = self._spec
        if not spec.use_velocity_scaled_lookahead_dist:
            return spec.lookahead_dist
        reach = min(max(abs(speed) * spec.lookahead_time, spec.min_lookahead_dist), spec.max_lookahead_dist)
        if self._robot.turning_radius > 0.0:
            reach = min(reach, max(spec.min_lookahead_dist, BEND * self._robot.turning_radius))
        return reach

    def _should_rotate(self, carrot: tuple[float, float]) -> bool:
        if not self._spec.use_rotate_to_heading or self._robot.turning_radius > 0.0:
            return False
        return abs(self._bearing(carrot)) > self._spec.rotate_to_heading_min_angle

    def _bearing(self, carrot: tuple[float, float]) -> float:
        """How far the end of the robot that goes first must turn to point at the carrot."""
        assert self._track is not None
        sign = 1.0 if self._track.forward else -1.0
        return math.atan2(sign * carrot[1], sign * carrot[0])

    def _drive(self, carrot: tuple[float, float], pose: Pose2, costmap: CostmapView) -> Twist:
        square = carrot[0] ** 2 + carrot[1] ** 2
        curvature = 2.0 * carrot[1] / square if square > 1e-6 else 0.0
        if self._robot.turning_radius > 0.0:
            tightest = 1.0 / self._robot.turning_radius
            curvature = min(max(curvature, -tightest), tightest)
        speed = self._regulated(curvature, pose, costmap)
        if abs(curvature) * speed > self._robot.max_angular:
            speed = self._robot.max_angular / abs(curvature)
        assert self._track is not None
        if not self._track.forward:
            speed = -min(speed, self._robot.max_reverse)
        return Twist(speed, 0.0, speed * curvature)

    def _regulated(self, curvature: float, pose: Pose2, costmap: CostmapView) -> float:
        spec, speed = self._spec, self._desired
        if self._limit is not None:
            speed = min(speed, self._limit)
        slow = speed
        if spec.use_regulated_linear_velocity_scaling and abs(curvature) * spec.regulated_linear_scaling_min_radius > 1:
            slow = min(slow, speed / (abs(curvature) * spec.regulated_linear_scaling_min_radius))
        if spec.use_cost_regulated_linear_velocity_scaling:
            near = distance_at(costmap, pose.x, pose.y)
            if near < spec.cost_scaling_dist:
                slow = min(slow, speed * spec.cost_scaling_gain * near / spec.cost_scaling_dist)
        speed = min(speed, max(slow, spec.regulated_linear_scaling_min_speed))
        return self._approaching(speed)

    def _approaching(self, speed: float) -> float:
        """Slow down near the end of the path, or of a piece: by Nav2's ratio, never faster than the brakes allow."""
        assert self._track is not None
        left, spec = self._track.to_cusp(), self._spec
        if left < spec.approach_velocity_scaling_dist:
            speed = min(
                speed, max(speed * left / spec.approach_velocity_scaling_dist, spec.min_approach_linear_velocity)
            )
        braking = math.sqrt(1.6 * self._robot.linear_deceleration * left)
        return min(speed, max(braking, spec.min_approach_linear_velocity))

    def _time_free(self, command: Twist, pose: Pose2, costmap: CostmapView, carrot: float) -> tuple[float, float]:
        """Seconds until the first collision on the arc up to the carrot, and how many are demanded."""
        allowed = self._spec.max_allowed_time_to_collision_up_to_carrot
        if not self._spec.use_collision_detection or command == STOP:
            return allowed, allowed
        horizon = min(allowed, carrot / abs(command.vx)) if command.vx != 0.0 else allowed
        return time_free(self._footprint, costmap, pose, command, horizon), horizon

    def _within_free_way(self, command: Twist, free: float, horizon: float) -> Twist:
        """Slow down, or fail, so that the time to collision is as long as demanded.

        Nav2 fails at once; slowing first lets the planner find a way round before the robot stands before a wall.
        """
        if free >= horizon:
            return command
        scale = free / self._spec.max_allowed_time_to_collision_up_to_carrot
        if abs(command.vx) * scale < CREEP:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, f"collision ahead in {free:.2f} s")
        return Twist(command.vx * scale, 0.0, command.wz * scale)


def _seen_from(pose: Pose2, x: float, y: float) -> tuple[float, float]:
    """A point of the map in the robot's frame."""
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    return cosine * (x - pose.x) + sine * (y - pose.y), cosine * (y - pose.y) - sine * (x - pose.x)
