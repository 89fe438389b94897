"""Dead reckoning from odometry."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.localizers import Ekf
from simscen.stack.frames import is_plausible
from simscen.stack.localizers.planar_motion import grow_covariance

_UNKNOWN_STD = (100.0, 100.0, np.pi / np.sqrt(3))
"""Standard deviations of an unknown pose: 100 m, and any heading."""
_NOISE = Ekf(type="ekf")


def initial_pose(estimate: Estimate) -> tuple[Pose2, Array]:
    """Return the initial pose and covariance (3, 3). An unknown pose starts at the origin of the map."""
    if estimate.pose is None:
        return Pose2(0.0, 0.0, 0.0), np.diag(np.square(_UNKNOWN_STD))
    return estimate.pose, np.diag(np.square(estimate.std))


class DeadReckoning:
    """Integrates odometry from the initial estimate. The covariance grows with the default noise of `ekf`."""

    def __init__(self, estimate: Estimate) -> None:
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Restart at an estimate."""
        pose, covariance = initial_pose(estimate)
        self._belief = Belief(pose, covariance, pose)
        self._odometry: Pose2 | None = None

    def on_odometry(self, odometry: Odometry) -> None:
        """Move the pose by the odometry since the last reading."""
        if not is_plausible(odometry.pose):
            return
        last, self._odometry = self._odometry, odometry.pose
        belief, step = self._belief, (last or odometry.pose).between(odometry.pose)
        covariance = grow_covariance(
            belief.covariance, belief.pose.yaw, step, _NOISE.translation_noise, _NOISE.rotation_noise
        )
        pose = belief.pose.compose(step)
        map_from_odom = pose.compose(odometry.pose.inverse()) if last is None else belief.map_from_odom
        self._belief = Belief(pose, covariance, map_from_odom, updated=odometry.tick)

    def on_scan(self, scan: Scan) -> None:
        """Ignore the reading."""

    def on_imu(self, imu: Imu) -> None:
        """Ignore the reading."""

    @property
    def belief(self) -> Belief:
        """The integrated pose and its covariance."""
        return self._belief
