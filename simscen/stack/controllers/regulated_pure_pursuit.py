"""Regulated pure pursuit controller (Macenski et al. 2023; nav2_regulated_pure_pursuit_controller)."""

import math
from typing import NamedTuple

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.controllers import RegulatedPurePursuit as RppSpec
from simscen.stack.controllers.collision_checker import CollisionChecker, RotationClearance
from simscen.stack.controllers.goal_rotation import BRAKING_FACTOR, GoalRotation
from simscen.stack.controllers.path_follower import PathFollower
from simscen.stack.controllers.path_handler import CUSP_REACHED_M, Extension, PathTracker
from simscen.stack.controllers.speed_regulation import SpeedRegulation
from simscen.stack.footprint import distance_at
from simscen.stack.kinematics import LOCAL_PLAN_TIMES_S, arc_poses
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

MIN_SQUARED_CHORD_M2 = 0.001
"""Squared distance of the carrot below which the arc is a straight line (Nav2's calculateCurvature)."""
CAR_LOOKAHEAD_RATIO = 0.4
"""Maximum lookahead distance of a car relative to its turning radius, so that the car does not cut S-bends."""
MIN_ROTATION_RAD = 0.1
"""Angle to the carrot below which a rotation in place does not help."""
LOOKAHEAD_RATIOS = (1.0, 0.7, 0.5, 0.35)
"""Factors on the lookahead distance, tried in this order until an arc is free (as in nav2_graceful_controller)."""


class Carrot(NamedTuple):
    """Point of the path that the robot steers to: x and y in m in the base frame."""

    x: float
    y: float

    @property
    def distance(self) -> float:
        """Distance from the robot in m."""
        return math.hypot(self.x, self.y)

    def bearing(self, is_backward: bool) -> float:
        """Return the angle in rad from the front of the robot to the carrot; from the back if `is_backward`."""
        sign = -1.0 if is_backward else 1.0
        return math.atan2(sign * self.y, sign * self.x)


class CheckedArc(NamedTuple):
    """A command with the result of its collision check.

    free_time:  time in s, at most `horizon`, for which the command causes no collision
    horizon:    time in s for which the command must not cause a collision
    """

    command: Twist
    free_time: float
    horizon: float


class RegulatedPurePursuit(PathFollower):
    """Steers to a carrot on the path, and regulates the speed by curvature, nearby obstacles, and distance to the goal.

    If the arc to the carrot is blocked, the controller tries nearer carrots, then a lower speed, and then a rotation.
    """

    def __init__(self, spec: RppSpec, setting: Setting) -> None:
        robot, footprint, period = setting.robot, setting.footprint, setting.control_period
        super().__init__(spec, spec.desired_linear_vel, robot)
        self._spec, self._robot, self._is_car = spec, robot, robot.turning_radius > 0.0
        self._goal_rotation = GoalRotation(
            robot, spec.rotate_to_heading_angular_vel, spec.max_angular_accel, period, spec.goal_tolerance_ratio
        )
        self._collision_checker = CollisionChecker(footprint, spec.min_slowed_speed)
        self._rotation_clearance = RotationClearance(footprint, robot.max_reverse)
        self._speed_regulation = SpeedRegulation(spec, setting)
        self.arc: tuple[Pose2, Twist] | None = None
        """Pose and velocity of the last command."""

    def reset_for_goal(self) -> None:
        """Reset the goal rotation for another goal."""
        self._goal_rotation.reset()

    @property
    def local_plan(self) -> Path | None:
        """The arc of the last command; None before the first command."""
        return None if self.arc is None else Path(arc_poses(*self.arc, LOCAL_PLAN_TIMES_S))

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the velocity command. Raises NO_VALID_CONTROL if no arc, rotation, or backing up is possible."""
        tracker = self._locate(pose)
        is_reached = self._goal_rotation.is_position_reached(pose, twist, goal, tracker.remaining())
        if is_reached and self._is_car:
            command = STOP
        elif is_reached and self._spec.use_rotate_to_heading:
            command = self._rotate(wrap(goal.pose.yaw - pose.yaw), pose, twist, costmap)
        else:
            command = self._follow(tracker, pose, twist, costmap)
        self.arc = (pose, command)
        return command

    def _follow(self, tracker: PathTracker, pose: Pose2, twist: Twist, costmap: CostmapView) -> Twist:
        """Return the command for the farthest carrot whose arc is free; if no arc is free, slow down or rotate."""
        spec, lookahead_distance = self._spec, self._lookahead_distance(twist.vx)
        can_rotate = spec.use_rotate_to_heading and not self._is_car
        fixed_carrot: Carrot | None = None
        if spec.use_fixed_curvature_lookahead:
            extension: Extension = "path" if spec.interpolate_curvature_after_goal else "none"
            fixed_carrot = _carrot(tracker, pose, spec.curvature_lookahead_dist, extension)
        arcs: list[CheckedArc] = []
        rotation: float | None = None
        escape_rotation: float | None = None
        for ratio in LOOKAHEAD_RATIOS:
            if ratio < 1.0 and ratio * lookahead_distance < spec.min_lookahead_dist:
                break
            carrot = _carrot(tracker, pose, ratio * lookahead_distance, "heading" if self._is_car else "none")
            curvature_carrot = carrot if fixed_carrot is None else fixed_carrot
            is_backward = not tracker.is_forward or (spec.allow_reversing and carrot.x < 0.0)
            bearing = curvature_carrot.bearing(is_backward)
            if can_rotate and abs(bearing) > spec.rotate_to_heading_min_angle:
                rotation = bearing
                break
            command = self._drive(tracker, curvature_carrot, is_backward, pose, costmap)
            arc = self._check_arc(command, pose, costmap, self._checked_distance(tracker, carrot))
            if arc.free_time >= arc.horizon:
                return self._slow_down_for_moving(command, pose, costmap, arc.horizon)
            arcs.append(arc)
            if escape_rotation is None and self._is_straight_free(carrot, is_backward, command, pose, costmap):
                escape_rotation = carrot.bearing(is_backward)
        if rotation is not None:
            return self._rotate(rotation, pose, twist, costmap)
        command, free_time, horizon = max(arcs, key=lambda arc: arc.free_time)
        full_speed_time = spec.max_allowed_time_to_collision_up_to_carrot
        try:
            slowed = self._collision_checker.slow_down(command, free_time, horizon, full_speed_time)
        except NavigationFailure:
            if escape_rotation is None:
                raise
            return self._rotate(escape_rotation, pose, twist, costmap)
        return self._slow_down_for_moving(slowed, pose, costmap, horizon)

    def _is_straight_free(
        self, carrot: Carrot, is_backward: bool, command: Twist, pose: Pose2, costmap: CostmapView
    ) -> bool:
        """Return whether a round robot could drive straight to the carrot after a rotation in place.

        False if the robot is not round, or if the angle to the carrot is small.
        """
        angle = carrot.bearing(is_backward)
        if not self._spec.use_rotate_to_heading or self._robot.radius is None or abs(angle) < MIN_ROTATION_RAD:
            return False
        rotated = Pose2(pose.x, pose.y, pose.yaw + angle)
        arc = self._check_arc(Twist(command.vx, 0.0, 0.0), rotated, costmap, carrot.distance)
        return arc.free_time >= arc.horizon

    def _checked_distance(self, tracker: PathTracker, carrot: Carrot) -> float:
        """Return the distance in m that must be free: to the carrot, or for a car at most to the end of the segment."""
        if not self._is_car:
            return carrot.distance
        return min(carrot.distance, max(CUSP_REACHED_M, tracker.remaining_in_segment()))

    def _rotate(self, angle: float, pose: Pose2, twist: Twist, costmap: CostmapView) -> Twist:
        """Return the command to rotate in place by `angle` rad; to back up if there is no room for this rotation."""
        if not self._spec.use_collision_detection or self._rotation_clearance.has_room(angle, pose, costmap):
            return self._goal_rotation.turn(angle, twist)
        command = self._rotation_clearance.backup_command(pose, costmap)
        if command is None:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "no room to turn, nor to back out")
        return command

    def _lookahead_distance(self, speed: float) -> float:
        """Return the lookahead distance in m at this speed."""
        spec = self._spec
        if not spec.use_velocity_scaled_lookahead_dist:
            return spec.lookahead_dist
        distance = min(max(abs(speed) * spec.lookahead_time, spec.min_lookahead_dist), spec.max_lookahead_dist)
        if self._is_car:
            distance = min(distance, max(spec.min_lookahead_dist, CAR_LOOKAHEAD_RATIO * self._robot.turning_radius))
        return distance

    def _drive(
        self, tracker: PathTracker, carrot: Carrot, is_backward: bool, pose: Pose2, costmap: CostmapView
    ) -> Twist:
        """Return the command for the arc to a carrot, at the regulated speed."""
        squared_chord = carrot.x**2 + carrot.y**2
        curvature = 2.0 * carrot.y / squared_chord if squared_chord > MIN_SQUARED_CHORD_M2 else 0.0
        if self._is_car:
            max_curvature = 1.0 / self._robot.turning_radius
            curvature = min(max(curvature, -max_curvature), max_curvature)
        speed = self._regulated_speed(tracker, curvature, pose, costmap)
        if abs(curvature) * speed > self._robot.max_angular:
            speed = self._robot.max_angular / abs(curvature)
        if is_backward:
            speed = -min(speed, self._robot.max_reverse)
        return Twist(speed, 0.0, speed * curvature)

    def _regulated_speed(self, tracker: PathTracker, curvature: float, pose: Pose2, costmap: CostmapView) -> float:
        """Return the speed in m/s, regulated by curvature, obstacles, the path ahead, and the end of the segment."""
        speed, regulation, spec = self._speed, self._speed_regulation, self._spec
        regulated = regulation.speed_at_curvature(speed, curvature)
        regulated = min(regulated, regulation.speed_at_distance(speed, distance_at(costmap, pose.x, pose.y)))
        regulated = regulation.speed_for_path_ahead(speed, regulated, tracker, costmap)
        regulated = max(regulated, spec.regulated_linear_scaling_min_speed)
        return min(speed, self._approach_speed(tracker, regulated, pose))

    def _approach_speed(self, tracker: PathTracker, speed: float, pose: Pose2) -> float:
        """Return `speed`, reduced near the end of the segment: scaled as in Nav2, and low enough to stop in time."""
        remaining, spec = tracker.remaining_in_segment(), self._spec
        if remaining < spec.approach_velocity_scaling_dist:
            distance = _to_robot_frame(pose, *tracker.segment_end).distance
            scaled = speed * distance / spec.approach_velocity_scaling_dist
            speed = min(speed, max(scaled, spec.min_approach_linear_velocity))
            remaining = max(remaining, distance)  # the robot may be beside the end of the path
        braking = math.sqrt(BRAKING_FACTOR * self._robot.linear_deceleration * remaining)
        return min(speed, max(braking, spec.min_approach_linear_velocity))

    def _check_arc(self, command: Twist, pose: Pose2, costmap: CostmapView, distance: float) -> CheckedArc:
        """Return the command as a CheckedArc. Its horizon is the time to drive `distance` m, limited as in Nav2."""
        max_time = self._spec.max_allowed_time_to_collision_up_to_carrot
        if not self._spec.use_collision_detection:
            return CheckedArc(command, max_time, max_time)
        horizon = min(max_time, distance / abs(command.vx)) if command.vx != 0.0 else max_time
        return CheckedArc(command, self._collision_checker.free_time(costmap, pose, command, horizon), horizon)

    def _slow_down_for_moving(self, command: Twist, pose: Pose2, costmap: CostmapView, horizon: float) -> Twist:
        """Return the command, slowed down to avoid moving obstacles for `horizon` s."""
        if not self._spec.use_collision_detection:
            return command
        return self._collision_checker.slow_down_for_moving(command, costmap, pose, horizon)


def _carrot(tracker: PathTracker, pose: Pose2, distance: float, extension: Extension) -> Carrot:
    """Return the carrot at `distance` m in the base frame. See `PathTracker.carrot` for `extension`."""
    return _to_robot_frame(pose, *tracker.carrot(pose, distance, extension))


def _to_robot_frame(pose: Pose2, x: float, y: float) -> Carrot:
    """Return a point in the frame of `pose`."""
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    return Carrot(cosine * (x - pose.x) + sine * (y - pose.y), cosine * (y - pose.y) - sine * (x - pose.x))
