"""Compensation of one-sided wheel slip by a disturbance observer with feedforward.

If one side slips more than the other, the robot drives a curve instead of a straight line. A pure-pursuit controller
then has a steady lateral error of half the curvature times the squared lookahead distance, which can exceed the
clearance in a narrow gap. The observer measures the curvature and subtracts it from the commands.
"""

import math

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist

DECAY_DISTANCE_M = 0.5
"""Distance in which an earlier estimate decays by a factor of e, because the ground changes."""
MAX_CURVATURE_PER_M = 1.0
"""Limit of the estimate, in case of a broken sensor."""


class TurnSlipObserver:
    """Compares wheel odometry with the odometry that fuses wheels and gyroscope."""

    def __init__(self) -> None:
        self._curvature = 0.0
        self._before: tuple[Pose2, Pose2] | None = None

    def learn(self, wheels: Pose2, fused: Pose2) -> None:
        """Update the estimate with poses of wheel and fused odometry; ignores values that are not finite."""
        if not math.isfinite(wheels.x + wheels.y + wheels.yaw + fused.yaw):
            return
        before, self._before = self._before, (wheels, fused)
        if before is None:
            return
        c, s = math.cos(before[0].yaw), math.sin(before[0].yaw)
        ahead = c * (wheels.x - before[0].x) + s * (wheels.y - before[0].y)
        turned = math.remainder((fused.yaw - before[1].yaw) - (wheels.yaw - before[0].yaw), math.tau)
        share = min(1.0, abs(ahead) / DECAY_DISTANCE_M)
        if ahead != 0.0:
            curvature = self._curvature + share * (turned / ahead - self._curvature)
            self._curvature = min(max(curvature, -MAX_CURVATURE_PER_M), MAX_CURVATURE_PER_M)

    def countered(self, command: Twist) -> Twist:
        """Return the command to send so that the robot turns as `command` intends."""
        if command.vx == 0.0 or self._curvature == 0.0:
            return command
        return Twist(command.vx, command.vy, command.wz - self._curvature * command.vx)
