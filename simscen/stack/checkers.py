"""Goal checker and progress checker, like those of nav2_controller."""

import math

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.model.controllers import ProgressChecker as ProgressSpec
from simscen.model.controllers import SimpleGoalChecker as GoalSpec
from simscen.stack.kinematics import is_standstill
from simscen.stack.setting import Setting

STANDSTILL_CHECKS = 10
"""Number of consecutive checks with a stationary robot after which the full tolerances apply: 0.5 s by default."""


class SimpleGoalChecker:
    """Decides whether the goal is reached, like nav2_controller::SimpleGoalChecker.

    While the robot moves, the tolerances are multiplied by `well_inside`, so that the robot does not stop at the edge
    of a tolerance. With `stateful`, the full position tolerance applies once the position has been reached.
    """

    def __init__(self, spec: GoalSpec, setting: Setting) -> None:
        self._is_stateful, self._well_inside = spec.stateful, spec.well_inside
        self._is_position_reached, self._standstill_checks = False, 0

    def reset(self) -> None:
        """Prepare for a new goal."""
        self._is_position_reached, self._standstill_checks = False, 0

    def reached(self, goal: Goal, pose: Pose2, twist: Twist) -> bool:
        """Return whether the robot has reached the goal, given its estimated pose in the map frame and its velocity."""
        self._standstill_checks = self._standstill_checks + 1 if is_standstill(twist) else 0
        ratio = 1.0 if self._standstill_checks >= STANDSTILL_CHECKS else self._well_inside
        distance = math.hypot(pose.x - goal.pose.x, pose.y - goal.pose.y)
        is_close = distance <= ratio * goal.xy_tolerance
        stays_close = self._is_stateful and self._is_position_reached and distance <= goal.xy_tolerance
        self._is_position_reached = is_close or stays_close
        heading_error = abs(wrap(goal.pose.yaw - pose.yaw))
        return self._is_position_reached and heading_error <= ratio * goal.yaw_tolerance


class ProgressChecker:
    """Decides whether the robot is stuck, like nav2_controller's SimpleProgressChecker and PoseProgressChecker.

    Within `movement_time_allowance` s, the robot must move by `required_movement_radius` m. If
    `required_movement_angle` is set, it is enough to turn by this angle in rad.
    """

    def __init__(self, spec: ProgressSpec) -> None:
        self._radius, self._angle = spec.required_movement_radius, spec.required_movement_angle
        self._allowance = spec.movement_time_allowance
        self._baseline: Pose2 | None = None
        self._baseline_time = 0.0

    def reset(self) -> None:
        """Measure progress from the next pose on."""
        self._baseline = None

    def is_stuck(self, pose: Pose2, now: float) -> bool:
        """Return whether the time allowance has passed without progress. `now` is the navigator's time in s."""
        baseline = self._baseline
        if (
            baseline is None
            or math.hypot(pose.x - baseline.x, pose.y - baseline.y) >= self._radius
            or (self._angle is not None and abs(wrap(pose.yaw - baseline.yaw)) >= self._angle)
        ):
            self._baseline, self._baseline_time = pose, now
        return now - self._baseline_time > self._allowance
