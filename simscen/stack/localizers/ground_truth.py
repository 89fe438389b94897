"""Where the robot is, as whoever runs the test says."""

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.messages.localization import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.stack.localizers.dead_reckoning import start_of
from simscen.stack.odometry_history import believable

TRUTH = "ground_truth"
"""The name of the sensor whose odometry readings are true poses in the map frame."""

# As sure as a survey: 1 mm and 1 mrad, so that the covariance can be inverted.
_COVARIANCE = np.diag([1e-6, 1e-6, 1e-6])


class GroundTruthLocalizer:
    """Believes what it is told by the sensor `ground_truth`, to tell faults of localisation from others.

    The truth arrives as odometry readings whose sensor is called "ground_truth" and whose pose is in the map frame;
    other odometry carries the pose on in between. A stack that is not fed any is left with dead reckoning.
    """

    def __init__(self, estimate: Estimate) -> None:
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate; the next truth replaces it."""
        self._started = False
        self._pose, self._covariance = start_of(estimate)
        self._map_from_odom, self._odometry, self._updated = self._pose, Pose2(0.0, 0.0, 0.0), -1

    def on_odometry(self, odometry: Odometry) -> None:
        """Take the truth, or a step of dead reckoning from it."""
        if not believable(odometry.pose):
            return
        if odometry.sensor == TRUTH:
            self._pose, self._covariance, self._updated = odometry.pose, _COVARIANCE, odometry.tick
        else:
            self._odometry = odometry.pose
        if odometry.tick <= self._updated or not self._started:
            self._map_from_odom = self._pose.compose(self._odometry.inverse())
        self._pose = self._map_from_odom.compose(self._odometry)
        self._started = True

    def on_scan(self, scan: Scan) -> None:
        """Nothing."""

    def on_imu(self, imu: Imu) -> None:
        """Nothing."""

    @property
    def belief(self) -> Belief:
        """The last truth, carried on by odometry."""
        return Belief(self._pose, self._covariance, self._map_from_odom, updated=max(self._updated, 0))
