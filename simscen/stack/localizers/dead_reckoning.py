"""Where the wheels say the robot is, counted from where it was told it started."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.localization import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.localizers import Ekf
from simscen.stack.localizers.planar_motion import grown
from simscen.stack.odometry_history import believable

# A place that nobody has told: 100 m and any heading.
_UNKNOWN_STD = (100.0, 100.0, np.pi / np.sqrt(3))
_NOISE = Ekf(type="ekf")


def start_of(estimate: Estimate) -> tuple[Pose2, Array]:
    """A pose and a covariance (3, 3) to start from; an unknown place starts at the origin of the map."""
    if estimate.pose is None:
        return Pose2(0.0, 0.0, 0.0), np.diag(np.square(_UNKNOWN_STD))
    return estimate.pose, np.diag(np.square(estimate.std))


class DeadReckoning:
    """Adds up odometry from the initial estimate; its covariance grows as the EKF's without a gyroscope does."""

    def __init__(self, estimate: Estimate) -> None:
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate."""
        pose, covariance = start_of(estimate)
        self._belief = Belief(pose, covariance, pose)
        self._odometry: Pose2 | None = None

    def on_odometry(self, odometry: Odometry) -> None:
        """Take a step."""
        if not believable(odometry.pose):
            return
        last, self._odometry = self._odometry, odometry.pose
        belief, step = self._belief, (last or odometry.pose).between(odometry.pose)
        covariance = grown(belief.covariance, belief.pose.yaw, step, _NOISE.translation_noise, _NOISE.rotation_noise)
        pose = belief.pose.compose(step)
        map_from_odom = pose.compose(odometry.pose.inverse()) if last is None else belief.map_from_odom
        self._belief = Belief(pose, covariance, map_from_odom, updated=odometry.tick)

    def on_scan(self, scan: Scan) -> None:
        """Nothing."""

    def on_imu(self, imu: Imu) -> None:
        """Nothing."""

    @property
    def belief(self) -> Belief:
        """The sum of all steps."""
        return self._belief
