"""Compensation of turn slip: the curvature that the wheels do not measure, in rad per meter driven."""

import math

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist

DECAY_DISTANCE_M = 0.5
"""Distance driven in which the weight of a measurement decays by a factor of e, because the ground changes."""
MAX_TURN_SLIP_RAD_PER_M = 1.0
"""Maximum absolute value of the estimated turn slip. Only a broken sensor would measure more."""


class TurnSlipObserver:
    """Estimates turn slip, and corrects commands for it.

    Turn slip is measured as the turn by fused odometry (with gyroscope) minus the turn by wheel odometry.
    """

    def __init__(self) -> None:
        self._curvature = 0.0
        """Estimated turn slip in rad/m."""
        self._before: tuple[Pose2, Pose2] | None = None
        """Last poses of wheel odometry and fused odometry."""

    def update(self, wheels: Pose2, fused: Pose2) -> None:
        """Update the estimate with poses of wheel odometry and fused odometry. Ignores poses that are not finite."""
        if not math.isfinite(wheels.x + wheels.y + wheels.yaw + fused.yaw):
            return
        before, self._before = self._before, (wheels, fused)
        if before is None:
            return
        c, s = math.cos(before[0].yaw), math.sin(before[0].yaw)
        driven = c * (wheels.x - before[0].x) + s * (wheels.y - before[0].y)
        slip_turn = math.remainder((fused.yaw - before[1].yaw) - (wheels.yaw - before[0].yaw), math.tau)
        gain = min(1.0, abs(driven) / DECAY_DISTANCE_M)
        if driven != 0.0:
            curvature = self._curvature + gain * (slip_turn / driven - self._curvature)
            self._curvature = min(max(curvature, -MAX_TURN_SLIP_RAD_PER_M), MAX_TURN_SLIP_RAD_PER_M)

    def compensate(self, command: Twist) -> Twist:
        """Return `command` with the estimated turn slip subtracted, so that the robot turns as intended."""
        if command.vx == 0.0 or self._curvature == 0.0:
            return command
        return Twist(command.vx, command.vy, command.wz - self._curvature * command.vx)
