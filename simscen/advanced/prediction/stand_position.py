"""Return of a standing robot to its position after it has stepped aside for a moving obstacle."""

import math

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.stack.protocols import RobotModel

ARRIVED_M, ARRIVED_RAD = 0.08, 0.15
"""Maximum distance and angle to the stand position at which the robot has returned."""
RETURN_DISTANCE_M = 0.15
"""Distance from the stand position at which the robot starts to return."""
RETURN_SPEED_RATIO, RETURN_GAIN_PER_S = 0.3, 1.0
"""Maximum speed of returning relative to full speed, and ratio of the speed in m/s to the distance in m."""
RETURN_TURN_RATE_RAD_S, TURN_GAIN_PER_S = 1.0, 2.0
"""Maximum turn rate of returning, and ratio of the turn rate in rad/s to the angle in rad."""
MAX_BEARING_RAD = 0.4
"""Angle between the heading and the direction of return above which the robot turns in place first."""


class StandPosition:
    """Pose to which a standing robot returns after it has stepped aside.

    The robot drives there in a straight line and then turns to the heading of the pose.
    """

    def __init__(self, robot: RobotModel, full_speed: float) -> None:
        """Take the robot and its full speed in m/s."""
        self._speed = RETURN_SPEED_RATIO * full_speed
        self._reverse_speed = min(self._speed, robot.max_reverse)
        self._max_turn_rate = min(RETURN_TURN_RATE_RAD_S, robot.max_angular)
        self._can_turn_in_place = robot.turning_radius == 0.0
        self._home: Pose2 | None = None
        self._is_away = False

    def clear(self) -> None:
        """Forget the pose."""
        self._home, self._is_away = None, False

    def remember(self, pose: Pose2, has_moving_obstacles: bool) -> Pose2 | None:
        """Return the stand position. It is None until an obstacle moves, and is then set to `pose`."""
        if self._home is None and has_moving_obstacles:
            self._home = pose
        return self._home

    def return_command(self, pose: Pose2) -> Twist:
        """Return the command that drives back. STOP at the stand position, or if the robot cannot turn in place."""
        home = self._home
        if home is None or not self._can_turn_in_place:
            return STOP
        distance = home.distance(pose)
        self._is_away = distance > (ARRIVED_M if self._is_away else RETURN_DISTANCE_M)
        if not self._is_away:
            turn = wrap(home.yaw - pose.yaw)
            return Twist(0.0, 0.0, self._turn_rate(turn)) if abs(turn) > ARRIVED_RAD else STOP
        bearing = wrap(math.atan2(home.y - pose.y, home.x - pose.x) - pose.yaw)
        is_backward = abs(bearing) > math.pi / 2 and self._reverse_speed > 0.0
        deviation = wrap(bearing + math.pi) if is_backward else bearing
        if abs(deviation) >= MAX_BEARING_RAD:
            return Twist(0.0, 0.0, self._turn_rate(deviation))
        speed = min(self._reverse_speed if is_backward else self._speed, RETURN_GAIN_PER_S * distance)
        return Twist(-speed if is_backward else speed, 0.0, self._turn_rate(deviation))

    def _turn_rate(self, angle: float) -> float:
        """Return the turn rate in rad/s for turning by an angle in rad."""
        return math.copysign(min(self._max_turn_rate, TURN_GAIN_PER_S * abs(angle)), angle)
