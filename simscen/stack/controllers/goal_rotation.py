"""Arrival at the goal, for all controllers: the position is reached first, then the heading by a rotation in place."""

import math

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.stack.protocols import RobotModel

PASSED_TOLERANCE_RATIO, PASSED_PATH_LENGTH_M = 0.8, 0.1
"""The position of a goal behind the robot counts as reached within this fraction of its tolerance, if the remaining
path is shorter than this length."""
STOPPED_SPEED_M_S, STOPPED_PATH_LENGTH_M = 0.01, 0.2
"""The position of a goal counts as reached within its full tolerance, if the speed and the remaining length of the path
are below these values."""
CAR_PATH_END_M = 0.03
"""Remaining length of the path below which a car has reached the goal."""
SETTLING_PERIODS = 2.0
"""Minimum number of control periods that the remaining rotation takes, so that the heading does not oscillate."""
BRAKING_FACTOR = 1.6
"""The speed before a stop is sqrt(factor · deceleration · distance). 2 is the physical limit; a smaller factor leaves a
reserve."""


class GoalRotation:
    """Decides whether the position of the goal is reached, and then rotates the robot to the heading of the goal."""

    def __init__(
        self, robot: RobotModel, max_turn_rate: float, acceleration: float, period: float, tolerance_ratio: float
    ) -> None:
        """Take the limits of the rotation in rad/s and rad/s², and the control `period` in s.

        The position is reached within the fraction `tolerance_ratio` of the goal's position tolerance.
        """
        self._tolerance_ratio = tolerance_ratio
        self._can_turn = robot.turning_radius == 0.0
        self._max_turn_rate = min(max_turn_rate, robot.max_angular)
        self._acceleration, self._period = acceleration, period
        self._was_reached = False

    def reset(self) -> None:
        """Prepare for another goal."""
        self._was_reached = False

    def is_position_reached(self, pose: Pose2, twist: Twist, goal: Goal, remaining: float) -> bool:
        """Return whether the position of the goal is reached. `remaining` is the remaining path length in m.

        Except for a car, the result stays True until the robot leaves the position tolerance.
        """
        distance = goal.pose.distance(pose)
        if not self._can_turn:
            return distance <= goal.xy_tolerance and remaining < CAR_PATH_END_M
        if distance > goal.xy_tolerance:
            self._was_reached = False
            return False
        dx, dy = goal.pose.x - pose.x, goal.pose.y - pose.y
        is_behind = dx * math.cos(pose.yaw) + dy * math.sin(pose.yaw) <= 0.0
        is_near = distance <= self._tolerance_ratio * goal.xy_tolerance
        has_stopped = abs(twist.vx) < STOPPED_SPEED_M_S and remaining < STOPPED_PATH_LENGTH_M
        has_passed = (
            distance <= PASSED_TOLERANCE_RATIO * goal.xy_tolerance and is_behind and remaining < PASSED_PATH_LENGTH_M
        )
        self._was_reached = self._was_reached or is_near or has_stopped or has_passed
        return self._was_reached

    def turn(self, angle: float, twist: Twist) -> Twist:
        """Return the command to rotate by `angle` rad, slow enough to stop at the end of the rotation."""
        braking = math.sqrt(BRAKING_FACTOR * self._acceleration * abs(angle))
        settling = abs(angle) / (SETTLING_PERIODS * self._period)
        turn_rate = math.copysign(min(self._max_turn_rate, braking, settling), angle)
        max_change = self._acceleration * self._period
        return Twist(0.0, 0.0, min(max(turn_rate, twist.wz - max_change), twist.wz + max_change))

    def turn_to_goal(self, pose: Pose2, goal: Goal, twist: Twist) -> Twist:
        """Return the command to rotate to the heading of the goal; a car stops instead."""
        if not self._can_turn:
            return STOP
        return self.turn(wrap(goal.pose.yaw - pose.yaw), twist)
