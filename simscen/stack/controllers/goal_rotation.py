"""Rotation in place to the heading of the goal, once a controller has reached its position."""

import math

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Goal
from simscen.stack.protocols import RobotModel

REACHED_TOLERANCE_RATIO, PASSED_TOLERANCE_RATIO = 0.45, 0.8
"""Fractions of the xy tolerance at which driving stops; the second one if the goal lies behind the robot."""

STOPPED_SPEED_M_S = 0.01
"""Speed below which a robot inside the tolerance counts as arrived."""

SETTLING_PERIODS = 2.0
"""Periods that the last of a turn takes at least: what turns further in one period than is left goes to and fro for
ever, and one that stands off the middle of its goal has to be at rest to have reached it."""

CAR_PATH_END_M = 0.03
"""Remaining path at which a car has arrived: the last arc gives it its heading."""


class GoalRotation:
    """Rotates to the heading of the goal, and remembers that the position is reached."""

    def __init__(self, robot: RobotModel, fastest: float, acceleration: float, period: float) -> None:
        self._can_turn = robot.turning_radius == 0.0
        self._fastest = min(fastest, robot.max_angular)
        self._acceleration, self._period = acceleration, period
        self._there = False

    def reset(self) -> None:
        """Forget that the position was reached, for a new path."""
        self._there = False

    def reached(self, pose: Pose2, twist: Twist, goal: Goal, remaining: float) -> bool:
        """Return whether to stop driving and to rotate; `remaining` is the length of the path that is left, in m."""
        distance = goal.pose.distance(pose)
        if not self._can_turn:
            return distance <= goal.xy_tolerance and remaining < CAR_PATH_END_M
        if distance > goal.xy_tolerance:
            self._there = False
            return False
        dx, dy = goal.pose.x - pose.x, goal.pose.y - pose.y
        behind = dx * math.cos(pose.yaw) + dy * math.sin(pose.yaw) <= 0.0
        near = distance <= REACHED_TOLERANCE_RATIO * goal.xy_tolerance or (
            abs(twist.vx) < STOPPED_SPEED_M_S and remaining < 0.2
        )
        passed = distance <= PASSED_TOLERANCE_RATIO * goal.xy_tolerance and behind and remaining < 0.1
        self._there = self._there or near or passed
        return self._there

    def turn(self, angle: float, twist: Twist) -> Twist:
        """Turn in place by `angle`, no faster than the base can stop at the end of it."""
        stopping = math.sqrt(1.6 * self._acceleration * abs(angle))
        settling = abs(angle) / (SETTLING_PERIODS * self._period)
        speed = math.copysign(min(self._fastest, stopping, settling), angle)
        change = self._acceleration * self._period
        return Twist(0.0, 0.0, min(max(speed, twist.wz - change), twist.wz + change))

    def turn_to_goal(self, pose: Pose2, goal: Goal, twist: Twist) -> Twist:
        """Return the command that rotates to the heading of the goal; a car stops with the heading it has."""
        if not self._can_turn:
            return STOP
        return self.turn(wrap(goal.pose.yaw - pose.yaw), twist)
