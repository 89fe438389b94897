"""Parameters of the odometry filter."""

from typing import Annotated, Literal

from pydantic import Field

from simscen.spec.base import Spec
from simscen.spec.quantities import Frequency, NonNegativeAngularSpeed

Variance = Annotated[float, Field(ge=0, le=1e6)]


class OdometryFilter(Spec):
    """Source of the transform from odom to base, as robot_localization's ekf_node sets it up for Nav2.

    Robots without an IMU use the wheel odometry as it is; so do the localizers that fuse both themselves (`ekf` and
    `slip_ekf`).
    """

    type: Literal["ekf", "wheel"] = "ekf"
    """`ekf`: an extended Kalman filter of wheel odometry and the yaw rate of the IMU. `wheel`: wheel odometry alone."""
    frequency: Frequency = 30.0
    """Largest rate of the updates. An update uses the motion and the turn since the last one, so nothing is lost. With
    wheel odometry at 40 Hz, every second reading causes an update."""
    process_noise_covariance: Annotated[list[Variance], Field(min_length=3, max_length=3)] = [10.0, 10.0, 10.0]
    """Variances by which vx, vy (m²/s²) and the yaw rate (rad²/s²) may change within one second. The diagonal of
    robot_localization's matrix; its other entries do not apply."""
    odom0_twist_rejection_threshold: Annotated[float, Field(gt=0, le=1e6)] = 5.0
    """The yaw rate of the wheels is not used while it differs from that of the gyroscope by more than this number of
    standard deviations: wheels slip in turns."""
    gyro_bias: NonNegativeAngularSpeed = 0.0005
    """Standard deviation of the bias of the gyroscope, which is estimated; 0 = no bias, as in robot_localization."""
    gyro_bias_walk: NonNegativeAngularSpeed = 0.00001
    """Standard deviation of the change of the bias within one second."""
