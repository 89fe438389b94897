"""Where a robot belongs that is to stand, and how it gets back there after it has stepped aside."""

import math

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.stack.protocols import RobotModel

THERE, TURNED = 0.08, 0.15
"""Metres and rad within which the robot stands where it belongs."""
LEFT = 0.15
"""Metres from there at which it sets out to come back."""
PART, GAIN = 0.3, 1.0
"""Of full speed at most on the way back, and m/s for each metre that is left."""
TURN = 1.0
"""rad/s at most on the way back."""
FACING = 0.4
"""rad off its line beyond which it turns before it drives."""


class Standing:
    """Remembers the pose; the way back is straight, forward or backward, and last the heading is turned to."""

    def __init__(self, robot: RobotModel, full_speed: float) -> None:
        self._speed, self._turn = PART * full_speed, min(TURN, robot.max_angular)
        self._reverses, self._turns = robot.max_reverse > 0.0, robot.turning_radius == 0.0
        self._home: Pose2 | None = None
        self._away = False

    def leave(self) -> None:
        """It drives again."""
        self._home, self._away = None, False

    def home(self, pose: Pose2, moving: bool) -> Pose2 | None:
        """Where it belongs, once something moves around it; None while it need not care."""
        if self._home is None and moving:
            self._home = pose
        return self._home

    def back(self, pose: Pose2) -> Twist:
        """The command on the way back; STOP where it belongs, or when it cannot turn to its line."""
        home = self._home
        if home is None or not self._turns:
            return STOP
        distance = home.distance(pose)
        self._away = distance > (THERE if self._away else LEFT)
        if not self._away:
            turn = wrap(home.yaw - pose.yaw)
            return Twist(0.0, 0.0, self._turned(turn)) if abs(turn) > TURNED else STOP
        bearing = wrap(math.atan2(home.y - pose.y, home.x - pose.x) - pose.yaw)
        sign = -1.0 if abs(bearing) > math.pi / 2 and self._reverses else 1.0
        off = wrap(bearing + math.pi) if sign < 0 else bearing
        speed = min(self._speed, GAIN * distance) if abs(off) < FACING else 0.0
        return Twist(sign * speed, 0.0, self._turned(off))

    def _turned(self, angle: float) -> float:
        return math.copysign(min(self._turn, 2.0 * abs(angle)), angle)
