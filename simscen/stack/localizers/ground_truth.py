"""Localizer that reports the true pose, to test the rest of a stack without localization errors."""

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.stack.localizers.dead_reckoning import initial_pose
from simscen.stack.odometry_history import is_plausible

TRUTH = "ground_truth"
"""Name of the sensor whose odometry readings are true poses in the map frame."""

_COVARIANCE = np.diag([1e-6, 1e-6, 1e-6])
"""Covariance of a true pose: standard deviations of 1 mm and 1 mrad, so that the matrix can be inverted."""


class GroundTruthLocalizer:
    """Localizer that reports the true pose, which the sensor TRUTH measures.

    Between true poses, wheel odometry moves the pose. Without true poses, this localizer is dead reckoning.
    """

    def __init__(self, estimate: Estimate) -> None:
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Restart at an estimate, which the next true pose replaces."""
        self._has_started = False
        self._pose, self._covariance = initial_pose(estimate)
        self._map_from_odom, self._odometry, self._updated = self._pose, Pose2(0.0, 0.0, 0.0), -1

    def on_odometry(self, odometry: Odometry) -> None:
        """Replace the pose by a true pose, or move the pose by wheel odometry."""
        if not is_plausible(odometry.pose):
            return
        if odometry.sensor == TRUTH:
            self._pose, self._covariance, self._updated = odometry.pose, _COVARIANCE, odometry.tick
        else:
            self._odometry = odometry.pose
        if odometry.tick <= self._updated or not self._has_started:
            self._map_from_odom = self._pose.compose(self._odometry.inverse())
        self._pose = self._map_from_odom.compose(self._odometry)
        self._has_started = True

    def on_scan(self, scan: Scan) -> None:
        """Ignore the reading."""

    def on_imu(self, imu: Imu) -> None:
        """Ignore the reading."""

    @property
    def belief(self) -> Belief:
        """The last true pose, moved by the wheel odometry since this pose."""
        return Belief(self._pose, self._covariance, self._map_from_odom, updated=max(self._updated, 0))
