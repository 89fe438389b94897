"""Regulated pure pursuit (Macenski et al. 2023; nav2_regulated_pure_pursuit_controller)."""

import math

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode, Goal, Path
from simscen.model.controllers import RegulatedPurePursuit as RppSpec
from simscen.stack.arcs import LOCAL_PLAN_TIMES_S, arc_poses
from simscen.stack.controllers.collision_checker import CollisionChecker, RotationClearance
from simscen.stack.controllers.goal_rotation import GoalRotation
from simscen.stack.controllers.path_follower import PathFollower
from simscen.stack.controllers.path_handler import CUSP_REACHED_M, PathTracker
from simscen.stack.controllers.speed_regulation import SpeedRegulation
from simscen.stack.footprint import distance_at
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

MIN_SQUARED_CHORD_M2 = 0.001
"""m²: nearer carrots are straight ahead (Nav2's calculateCurvature)."""
CAR_LOOKAHEAD_RATIO = 0.4
"""Of its turning radius a car looks ahead at most: its plans go from full left to full right, and what a chord cuts off
there it cannot make good again."""
MIN_ROTATION_RAD = 0.1
"""rad. Carrots that lie less to the side than that are straight ahead: to turn to them changes nothing."""
LOOKAHEAD_RATIOS = (1.0, 0.7, 0.5, 0.35)
"""Parts of the look-ahead distance that are tried until the arc is free: an arc to a far carrot cuts the path's bends,
shorter ones keep to it. nav2_graceful_controller goes through its targets likewise."""


class RegulatedPurePursuit(PathFollower):
    """Steers at a carrot on the path and regulates its speed by curvature, nearness of obstacles and of the goal."""

    def __init__(self, spec: RppSpec, setting: Setting) -> None:
        robot, footprint, period = setting.robot, setting.footprint, setting.control_period
        super().__init__(spec.desired_linear_vel, robot)
        self._spec, self._robot, self._free_way = spec, robot, CollisionChecker(footprint)
        self._goal_pose = GoalRotation(robot, spec.rotate_to_heading_angular_vel, spec.max_angular_accel, period)
        self._turning, self._slowing = RotationClearance(footprint), SpeedRegulation(spec, setting)
        self.arc: tuple[Pose2, Twist] | None = None
        """The pose and the velocity of its last command."""

    def begin(self) -> None:
        """Another goal."""
        self._goal_pose.reset()

    @property
    def local_plan(self) -> Path | None:
        """The arc it expects to drive in the next second and a half."""
        return None if self.arc is None else Path(arc_poses(*self.arc, LOCAL_PLAN_TIMES_S))

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the velocity to drive now. Raises NO_VALID_CONTROL when the arc to the carrot is blocked."""
        track, steered = self._located(pose), self._robot.turning_radius > 0.0
        there = self._goal_pose.reached(pose, twist, goal, track.remaining())
        if there and (steered or self._spec.use_rotate_to_heading):
            command = STOP if steered else self._turn(wrap(goal.pose.yaw - pose.yaw), pose, twist, costmap)
        else:
            command = self._follow(track, pose, twist, costmap)
        self.arc = (pose, command)
        return command

    def _follow(self, track: PathTracker, pose: Pose2, twist: Twist, costmap: CostmapView) -> Twist:
        """To the farthest carrot that can be reached freely; if none can, on the arc that is free for longest."""
        reach = self._lookahead(twist.vx)
        arcs: list[tuple[float, float, Twist]] = []
        turn: float | None = None
        aside: float | None = None
        for part in LOOKAHEAD_RATIOS:
            if part < 1.0 and part * reach < self._spec.min_lookahead_dist:
                break
            carrot = _seen_from(pose, *track.carrot(pose, part * reach, beyond=self._robot.turning_radius > 0.0))
            bend = self._bend(track, pose) if self._spec.use_fixed_curvature_lookahead else carrot
            backward = not track.forward or (self._spec.allow_reversing and carrot[0] < 0.0)
            if self._should_rotate(bend, backward):
                turn = _bearing(bend, backward)
                break
            command = self._drive(bend, backward, pose, costmap)
            free, horizon = self._time_free(command, pose, costmap, self._as_far_as(carrot))
            if free >= horizon:
                return self._letting_pass(command, pose, costmap, horizon)
            arcs.append((free, horizon, command))
            if aside is None and self._straight_is_free(carrot, backward, command, pose, costmap):
                aside = _bearing(carrot, backward)
        if turn is not None:
            return self._turn(turn, pose, twist, costmap)
        free, horizon, command = max(arcs, key=lambda arc_poses: arc_poses[0])
        demanded = self._spec.max_allowed_time_to_collision_up_to_carrot
        try:
            slower = self._free_way.within(command, free, horizon, demanded)
        except NavigationFailure:
            if aside is None:
                raise
            return self._turn(aside, pose, twist, costmap)
        return self._letting_pass(slower, pose, costmap, horizon)

    def _straight_is_free(
        self, carrot: tuple[float, float], backward: bool, arc_poses: Twist, pose: Pose2, costmap: CostmapView
    ) -> bool:
        """Return whether the robot could drive straight to the carrot after a rotation, where the arc collides.

        Out of a tight place that is often the only way; nav2_regulated_pure_pursuit fails there. A hull that is not
        round would come nearer to what it stands beside by turning.
        """
        angle = _bearing(carrot, backward)
        if not self._spec.use_rotate_to_heading or self._robot.radius is None or abs(angle) < MIN_ROTATION_RAD:
            return False
        free, horizon = self._time_free(
            Twist(arc_poses.vx, 0.0, 0.0), Pose2(pose.x, pose.y, pose.yaw + angle), costmap, math.hypot(*carrot)
        )
        return free >= horizon

    def _bend(self, track: PathTracker, pose: Pose2) -> tuple[float, float]:
        """Return the point that determines the curvature with use_fixed_curvature_lookahead."""
        beyond = self._spec.interpolate_curvature_after_goal
        return _seen_from(pose, *track.carrot(pose, self._spec.curvature_lookahead_dist, beyond=beyond))

    def _as_far_as(self, carrot: tuple[float, float]) -> float:
        """Return the distance in m that must be free: to the carrot, or for a car to where it stops."""
        assert self._track is not None
        away = math.hypot(*carrot)
        return min(away, max(CUSP_REACHED_M, self._track.to_cusp())) if self._robot.turning_radius > 0.0 else away

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
            reach = min(reach, max(spec.min_lookahead_dist, CAR_LOOKAHEAD_RATIO * self._robot.turning_radius))
        return reach

    def _should_rotate(self, carrot: tuple[float, float], backward: bool) -> bool:
        if not self._spec.use_rotate_to_heading or self._robot.turning_radius > 0.0:
            return False
        return abs(_bearing(carrot, backward)) > self._spec.rotate_to_heading_min_angle

    def _drive(self, carrot: tuple[float, float], backward: bool, pose: Pose2, costmap: CostmapView) -> Twist:
        square = carrot[0] ** 2 + carrot[1] ** 2
        curvature = 2.0 * carrot[1] / square if square > MIN_SQUARED_CHORD_M2 else 0.0
        if self._robot.turning_radius > 0.0:
            tightest = 1.0 / self._robot.turning_radius
            curvature = min(max(curvature, -tightest), tightest)
        speed = self._regulated(curvature, pose, costmap)
        if abs(curvature) * speed > self._robot.max_angular:
            speed = self._robot.max_angular / abs(curvature)
        if backward:
            speed = -min(speed, self._robot.max_reverse)
        return Twist(speed, 0.0, speed * curvature)

    def _regulated(self, curvature: float, pose: Pose2, costmap: CostmapView) -> float:
        assert self._track is not None
        speed, slowing = self._speed, self._slowing
        slow = slowing.within(speed, curvature)
        if self._spec.use_cost_regulated_linear_velocity_scaling:
            slow = min(slow, slowing.beside(speed, distance_at(costmap, pose.x, pose.y)))
        slow = slowing.before(speed, slow, self._track, costmap)
        return min(speed, self._approaching(max(slow, self._spec.regulated_linear_scaling_min_speed), pose))

    def _approaching(self, speed: float, pose: Pose2) -> float:
        """Slow down near the end of the path, or of a piece: by Nav2's ratio, never faster than the brakes allow."""
        assert self._track is not None
        left, spec = self._track.to_cusp(), self._spec
        if left < spec.approach_velocity_scaling_dist:
            near = math.hypot(*_seen_from(pose, *self._track.piece_end))
            scaled = speed * near / spec.approach_velocity_scaling_dist
            speed = min(speed, max(scaled, spec.min_approach_linear_velocity))
            left = max(left, near)  # who has made way for somebody at the end of the path has to come back to it
        braking = math.sqrt(1.6 * self._robot.linear_deceleration * left)
        return min(speed, max(braking, spec.min_approach_linear_velocity))

    def _time_free(self, command: Twist, pose: Pose2, costmap: CostmapView, carrot: float) -> tuple[float, float]:
        """Seconds until the first collision on the arc up to the carrot, and how many are demanded."""
        allowed = self._spec.max_allowed_time_to_collision_up_to_carrot
        if not self._spec.use_collision_detection:
            return allowed, allowed
        horizon = min(allowed, carrot / abs(command.vx)) if command.vx != 0.0 else allowed
        return self._free_way.seconds(costmap, pose, command, horizon), horizon

    def _letting_pass(self, command: Twist, pose: Pose2, costmap: CostmapView, horizon: float) -> Twist:
        """Return the command, slowed where it would hit a moving obstacle."""
        if not self._spec.use_collision_detection:
            return command
        return self._free_way.letting_pass(command, costmap, pose, horizon)


def _bearing(carrot: tuple[float, float], backward: bool) -> float:
    """How far the end of the robot that goes first must turn to point at the carrot."""
    sign = -1.0 if backward else 1.0
    return math.atan2(sign * carrot[1], sign * carrot[0])


def _seen_from(pose: Pose2, x: float, y: float) -> tuple[float, float]:
    """Return a point of the map in the frame of the robot."""
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    return cosine * (x - pose.x) + sine * (y - pose.y), cosine * (y - pose.y) - sine * (x - pose.x)
