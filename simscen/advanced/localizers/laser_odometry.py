"""What scans say of a way that was reckoned from wheels and gyroscope: laser odometry beside them.

Wheels that slip count meters that nobody drove, and no gyroscope shows it. What the lidar sees stands still.
"""

import math

from simscen.advanced.localizers.scan_matcher import ScanMatcher
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.stack.odometry_history import OdometryHistory


class LaserOdometry:
    """Corrects the translations of dead reckoning from scan to scan of the first lidar that spoke; headings stay."""

    def __init__(self, tick_rate: int) -> None:
        self._matcher = ScanMatcher()
        self._reckoned = OdometryHistory(tick_rate)
        self._x = self._y = 0.0
        self._before: tuple[str, Pose2] | None = None

    def reckon(self, tick: int, pose: Pose2) -> None:
        """Where the robot is by now, all corrections so far included."""
        self._reckoned.add(tick, Pose2(pose.x - self._x, pose.y - self._y, pose.yaw))

    def correction(self, scan: Scan) -> tuple[float, float]:
        """By how many meters along x and y the robot is elsewhere than was reckoned since the last scan.

        Nothing where the scans do not tell, or say something quite different: then it is they that are wrong, for what
        they show moves.
        """
        if not self._reckoned:
            return 0.0, 0.0
        here = self._reckoned.held(scan.tick)
        sensor, before = self._before or (scan.sensor, here)
        if scan.sensor != sensor:
            return 0.0, 0.0
        self._before = sensor, here
        reckoned = before.between(here)
        step = self._matcher.step(scan, reckoned)
        if step is None or not step.agrees(reckoned):
            return 0.0, 0.0
        ahead, left = step.delta.x - reckoned.x, step.delta.y - reckoned.y
        c, s = math.cos(before.yaw), math.sin(before.yaw)
        x, y = c * ahead - s * left, s * ahead + c * left
        self._x, self._y = self._x + x, self._y + y
        return x, y
