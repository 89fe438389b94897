"""How much more the ground turns a robot than its wheels say, and the command that makes good for it.

Wheels of which one side slips more than the other drive a bend where a straight was asked for. A controller that
steers at a point ahead then drives beside its path for good, by half that bend times its look-ahead squared: more than
the room there is in a narrow gap. A disturbance observer, and feedforward: what was measured is taken off the command.
"""

import math

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist

DECAY_DISTANCE_M = 0.5
"""Meters driven in which what was learned fades by a factor of e: turns and ground change."""
MAX_CURVATURE_PER_M = 1.0
"""1/m: no more of a bend is believed, whatever a broken sensor says."""


class TurnSlipObserver:
    """Compares the wheels' steps with those that wheels and gyroscope agree on."""

    def __init__(self) -> None:
        self._bend = 0.0
        self._before: tuple[Pose2, Pose2] | None = None

    def learn(self, wheels: Pose2, fused: Pose2) -> None:
        """Where the wheels say the robot is, each step along what they turned, and where it is taken to be.

        Numbers that are not finite, as of a broken sensor, teach nothing.
        """
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
            bend = self._bend + share * (turned / ahead - self._bend)
            self._bend = min(max(bend, -MAX_CURVATURE_PER_M), MAX_CURVATURE_PER_M)

    def countered(self, command: Twist) -> Twist:
        """The command to send so that the robot turns as this one says."""
        if command.vx == 0.0 or self._bend == 0.0:
            return command
        return Twist(command.vx, command.vy, command.wz - self._bend * command.vx)
