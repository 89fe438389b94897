"""Laser odometry: correction of dead reckoning by scan matching.

Slipping wheels measure a distance that the robot did not drive, which a gyroscope does not show, but scans do.
"""

import math

from simscen.advanced.localizers.scan_matcher import ScanMatcher
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.stack.frames import OdometryHistory


class LaserOdometry:
    """Corrects the translation of dead reckoning between scans of one lidar. The heading is not changed."""

    def __init__(self, tick_rate: int) -> None:
        self._matcher = ScanMatcher()
        self._dead_reckoning = OdometryHistory(tick_rate)
        self._x = self._y = 0.0
        self._previous: tuple[str, Pose2] | None = None

    def add_pose(self, tick: int, pose: Pose2) -> None:
        """Add a pose of dead reckoning, which includes all corrections so far."""
        self._dead_reckoning.add(tick, Pose2(pose.x - self._x, pose.y - self._y, pose.yaw))

    def correction(self, scan: Scan) -> tuple[float, float]:
        """Return the error of dead reckoning since the last scan, along x and y of the map in m.

        It is 0 if scans do not show the motion, or if they differ from dead reckoning by more than slip explains,
        because then the scans show moving objects.
        """
        if not self._dead_reckoning:
            return 0.0, 0.0
        current = self._dead_reckoning.latest_until(scan.tick)
        sensor, previous = self._previous or (scan.sensor, current)
        if scan.sensor != sensor:
            return 0.0, 0.0
        self._previous = sensor, current
        driven = previous.between(current)
        step = self._matcher.step(scan, driven)
        if step is None or not step.agrees(driven):
            return 0.0, 0.0
        forward, left = step.delta.x - driven.x, step.delta.y - driven.y
        c, s = math.cos(previous.yaw), math.sin(previous.yaw)
        x, y = c * forward - s * left, s * forward + c * left
        self._x, self._y = self._x + x, self._y + y
        return x, y
