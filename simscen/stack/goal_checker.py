"""When a goal is reached: nav2_controller::SimpleGoalChecker, a little stricter.

Nav2 accepts at the very edge of the tolerance, which turns a localization error of a centimeter into a false success.
Here the robot goes on until it is well inside, or until it stands anywhere inside.
"""

import math

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Goal
from simscen.model.checkers import SimpleGoalChecker as Spec
from simscen.stack.setting import Setting

STANDING = 0.02
"""m/s and rad/s (times five) under which a robot stands."""
AT_REST = 10
"""Checks in a row in which a robot must stand to be at rest: half a second at the controller's usual rate. It also
stands for a moment between driving up to the goal and turning to its heading."""


class SimpleGoalChecker:
    """Position first, heading then; a position once reached stays reached (`stateful`) while the robot turns."""

    def __init__(self, spec: Spec, setting: Setting) -> None:
        self._stateful, self._well_inside = spec.stateful, spec.well_inside
        self._there, self._stood = False, 0

    def reset(self) -> None:
        """A new goal."""
        self._there, self._stood = False, 0

    def reached(self, goal: Goal, pose: Pose2, twist: Twist) -> bool:
        """Whether the robot, believed at `pose`, has reached the goal."""
        standing = abs(twist.vx) + abs(twist.vy) < STANDING and abs(twist.wz) < 5 * STANDING
        self._stood = self._stood + 1 if standing else 0
        part = 1.0 if self._stood >= AT_REST else self._well_inside
        away = math.hypot(pose.x - goal.pose.x, pose.y - goal.pose.y)
        there = away <= part * goal.xy_tolerance
        self._there = there or (self._stateful and self._there and away <= goal.xy_tolerance)
        return self._there and abs(wrap(goal.pose.yaw - pose.yaw)) <= part * goal.yaw_tolerance
