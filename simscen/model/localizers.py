"""Specifications of the localizers and of the odometry filter, with Nav2's names and default values."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from simscen.spec.base import Ranged, Spec, Typed
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.quantities import (
    Frequency,
    Length,
    NonNegativeAngle,
    NonNegativeAngularSpeed,
    NonNegativeLength,
    PositiveLength,
    Probability,
    Quantity,
)

Noise = Annotated[float, Field(ge=0, le=100)]


class LocalizerSpec(Typed):
    """Base class of localizer specifications."""

    fuses_odometry: ClassVar[bool] = False
    """Whether the localizer fuses odometry and IMU itself. It then also defines the odom frame."""
    needs_map: ClassVar[bool] = False
    """Whether the localizer compares sensor data with a map."""
    precomputation: ClassVar[str] = ""
    """Address `package.module:function` of a precomputation; "" for none. It is called as `function(spec, grid)`, once
    per map, before the runs start."""


class AmclParameters(Ranged, LocalizerSpec):
    """Base class of particle filters, with the parameters of nav2_amcl.

    The defaults are those of nav2_amcl, except for `robot_model` and `laser_model_type`.
    """

    needs_map: ClassVar[bool] = True
    unlimited_at_zero: ClassVar[tuple[str, ...]] = ("laser_max_range",)
    robot_model: Literal["differential", "omni"] | None = None
    """Motion model; default: the model of the robot's drive."""
    alpha1: Noise = 0.2
    """Rotation noise from rotation."""
    alpha2: Noise = 0.2
    """Rotation noise from translation."""
    alpha3: Noise = 0.2
    """Translation noise from translation."""
    alpha4: Noise = 0.2
    """Translation noise from rotation."""
    alpha5: Noise = 0.2
    """Strafing noise of the omni model."""
    min_particles: Annotated[int, Field(ge=10, le=50_000)] = 500
    """Minimum number of particles. KLD sampling adapts the number between minimum and maximum."""
    max_particles: Annotated[int, Field(ge=10, le=50_000)] = 2000
    """Maximum number of particles, and the number at the start."""
    pf_err: Annotated[float, Field(gt=0, lt=1), Quantity("ratio")] = 0.05
    """KLD sampling: maximum distance between the true and the sampled distribution."""
    pf_z: Annotated[float, Field(gt=0, lt=1)] = 0.99
    """KLD sampling: upper quantile z of the standard normal distribution. As in Nav2, this is not a probability."""
    update_min_d: NonNegativeLength = 0.25
    """Distance that the robot must move before the next filter update."""
    update_min_a: Annotated[NonNegativeAngle, Field(le=6.3)] = 0.2
    """Angle that the robot must turn before the next filter update."""
    resample_interval: Annotated[int, Field(ge=1, le=100)] = 1
    """Number of filter updates per resampling."""
    max_beams: Annotated[int, Field(ge=2, le=4096)] = 60
    """Maximum number of beams of a scan that are compared with the map."""
    laser_model_type: Literal["likelihood_field", "likelihood_field_prob", "beam"] = "likelihood_field_prob"
    """Sensor model. `likelihood_field`, the default of nav2_amcl, tolerates more obstacles that are not on the map. It
    is less accurate, and fails if scans are far apart."""
    z_hit: Probability = 0.5
    """Weight of beams that end at an obstacle of the map."""
    z_short: Probability = 0.05
    """Weight of beams that end before an obstacle of the map; `beam` model only."""
    z_max: Probability = 0.05
    """Weight of beams that measure the maximum range; `beam` model only."""
    z_rand: Probability = 0.5
    """Weight of random measurements."""
    sigma_hit: Annotated[Length, Field(ge=0.001)] = 0.2
    """Standard deviation of the endpoints of beams that hit an obstacle of the map."""
    lambda_short: Annotated[float, Field(gt=0, le=100)] = 0.1
    """Exponential decay of short measurements, per meter; `beam` model only."""
    laser_likelihood_max_dist: PositiveLength = 2.0
    """Maximum distance from obstacles in the likelihood field."""
    laser_min_range: Length = -1.0
    """Minimum range of used beams, if it is above the minimum of the lidar; 0 or less = the minimum of the lidar."""
    laser_max_range: Length = 100.0
    """Maximum range of used beams, if it is below the maximum of the lidar; 0 or less = the maximum of the lidar."""
    recovery_alpha_slow: Probability = 0.0
    """Decay rate of the slow average of the likelihood of scans; 0: all scans have the same weight."""
    recovery_alpha_fast: Probability = 0.0
    """Decay rate of the fast average of the likelihood of scans; 0 = no random particles are added."""
    selective_resampling: bool = False
    """Whether to resample only if the effective number of particles is below half of their number."""
    do_beamskip: bool = False
    """Whether to skip beams that fit few particles once the filter has converged; `likelihood_field_prob` only."""
    beam_skip_distance: PositiveLength = 0.5
    """Maximum distance of the end of a beam from an obstacle of the map for which the beam fits a particle."""
    beam_skip_threshold: Probability = 0.3
    """Minimum fraction of the particles that a beam must fit. Other beams are skipped."""
    beam_skip_error_threshold: Probability = 0.9
    """If at least this fraction of the beams would be skipped, the pose counts as wrong, and no beam is skipped."""

    @property
    def max_used_range(self) -> float:
        """`laser_max_range` in m, or infinity if only the maximum range of the lidar applies."""
        return self.laser_max_range if self.laser_max_range > 0.0 else math.inf


class Amcl(AmclParameters):
    """Particle filter as in nav2_amcl (Thrun et al., Probabilistic Robotics, ch. 8)."""

    component: ClassVar[str] = "simscen.stack.localizers.build:amcl"
    precomputation: ClassVar[str] = "simscen.stack.localizers.build:precompute"
    type: Literal["amcl"] = "amcl"
    parameters: Literal["nav2"] | None = None
    """Deprecated: use `profile: nav2` for the default values of nav2_amcl."""

    @model_validator(mode="before")
    @classmethod
    def _apply_nav2_values(cls, values: Any) -> Any:
        """Apply the deprecated `parameters: nav2` to values that are not given."""
        if isinstance(values, Mapping) and values.get("parameters") == "nav2":
            return {"laser_model_type": "likelihood_field", **values}
        return values


class EkfParameters(LocalizerSpec):
    """Base class of Kalman filters that fuse wheel odometry and gyroscope."""

    fuses_odometry: ClassVar[bool] = True
    translation_noise: Annotated[NonNegativeLength, Field(le=100)] = 0.02
    """Standard deviation of the position after one meter."""
    rotation_noise: NonNegativeAngle = 0.02
    """Standard deviation of the heading after a turn of one rad, and after one meter."""
    gyro_noise: NonNegativeAngularSpeed = 0.005
    """Standard deviation of the yaw rate."""
    gyro_bias: NonNegativeAngularSpeed | None = None
    """Standard deviation of the gyroscope's bias at the start; default: the same as `gyro_noise`."""
    gyro_bias_walk: NonNegativeAngularSpeed = 0.0001
    """Standard deviation of the change of the bias within one second."""


class Ekf(EkfParameters):
    """Extended Kalman filter of odometry and gyroscope, as in robot_localization. It drifts, because it uses no map."""

    component: ClassVar[str] = "simscen.stack.localizers.build:ekf"
    type: Literal["ekf"]


class GroundTruth(LocalizerSpec):
    """Localizer that returns the true pose, to test navigation without localization errors."""

    component: ClassVar[str] = "simscen.stack.localizers.build:ground_truth"
    type: Literal["ground_truth"]


class OdometryOnly(LocalizerSpec):
    """Dead reckoning from the initial pose."""

    component: ClassVar[str] = "simscen.stack.localizers.build:odometry"
    type: Literal["odometry"]


LOCALIZERS = {
    "amcl": "simscen.model.localizers:Amcl",
    "ekf": "simscen.model.localizers:Ekf",
    "ground_truth": "simscen.model.localizers:GroundTruth",
    "odometry": "simscen.model.localizers:OdometryOnly",
}
"""Specifications of the localizers of the reference stack as `module:Class`, by type."""
Localizer = Annotated[LocalizerSpec, ExtensibleUnion("localizer", default="amcl")]


Variance = Annotated[float, Field(ge=0, le=1e6)]


class OdometryFilter(Spec):
    """Source of the transform from odom to base. The default is an EKF, like robot_localization's ekf_node in Nav2.

    The EKF is not used on robots without an IMU, and not with the localizers `ekf` and `slip_ekf`, which fuse wheel
    odometry and IMU themselves.
    """

    type: Literal["ekf", "wheel"] = "ekf"
    """`ekf`: an extended Kalman filter of wheel odometry and the yaw rate of the IMU. `wheel`: wheel odometry alone."""
    frequency: Frequency = 30.0
    """Maximum rate of the updates. An update uses all motion since the previous update."""
    process_noise_covariance: Annotated[list[Variance], Field(min_length=3, max_length=3)] = [10.0, 10.0, 10.0]
    """Variances of the change of vx, vy (m²/s²) and the yaw rate (rad²/s²) within one second: the diagonal of
    robot_localization's matrix."""
    odom0_twist_rejection_threshold: Annotated[float, Field(gt=0, le=1e6)] = 5.0
    """Maximum difference between the yaw rates of the wheels and of the gyroscope, in standard deviations. While the
    difference is larger, the yaw rate of the wheels is not used."""
    gyro_bias: NonNegativeAngularSpeed = 0.0005
    """Standard deviation of the estimated bias of the gyroscope; 0 = no bias, as in robot_localization."""
    gyro_bias_walk: NonNegativeAngularSpeed = 0.00001
    """Standard deviation of the change of the bias within one second."""
