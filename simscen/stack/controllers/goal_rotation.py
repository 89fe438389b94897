"""Rotation in place to the heading of the goal, once a controller has reached its position."""

import math

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Goal
from simscen.stack.protocols import RobotModel

REACHED_TOLERANCE_RATIO, PASSED_TOLERANCE_RATIO = 0.45, 0.8
"""Parts of the goal's xy tolerance: so near, stop driving; so near with the goal behind, too."""

STOPPED_SPEED_M_S = 0.01
"""m/s. A controller that has come to rest inside the tolerance is as near as it gets."""

SETTLING_PERIODS = 2.0
"""Periods that the last of a turn takes at least: what turns further in one period than is left goes to and fro for
ever, and one that stands off the middle of its goal has to be at rest to have reached it."""

CAR_PATH_END_M = 0.03
"""Meters of path that a car may leave out: its last arc is what gives it its heading."""


class GoalRotation:
    """Remembers that the position is reached, so that turning does not start another approach."""

    def __init__(self, robot: RobotModel, fastest: float, acceleration: float, period: float) -> None:
        self._can_turn = robot.turning_radius == 0.0
        self._fastest = min(fastest, robot.max_angular)
        self._acceleration, self._period = acceleration, period
        self._there = False

    def reset(self) -> None:
        """A new path."""
        self._there = False

    def reached(self, pose: Pose2, twist: Twist, goal: Goal, remaining: float) -> bool:
        """Whether to stop driving and to turn to the goal's heading; `remaining` meters of path are left."""
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
        """Turn to the goal's heading; a car stands, as it has come with the heading it has."""
        if not self._can_turn:
            return STOP
        return self.turn(wrap(goal.pose.yaw - pose.yaw), twist)
