"""The parameters of localizers, with Nav2's names; what differs from Nav2's defaults says so."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from simscen.spec.base import Ranged, type_discriminator
from simscen.spec.bytype import ByType
from simscen.spec.component import Typed
from simscen.spec.quantities import (
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
    """What knows where the robot is."""

    fuses_odometry: ClassVar[bool] = False
    """Whether it never jumps, and so is the odom frame itself, as robot_localization is that publishes odom→base."""


AMCL_PARAMETERS: Mapping[str, Mapping[str, object]] = {
    "default": {},
    "nav2": {
        "laser_model_type": "likelihood_field", "sigma_hit": 0.2, "likelihood_exponent": 1.0,
        "beams_beyond_the_map": "miss", "map_trust_none": 0.0, "map_trust_full": 0.0,
        "match_scans": False, "settling_distance": 0.0, "relocalization": "random", "sure_update_interval": 1,
    },
    "consistent": {"covariance": "scatter", "sure_update_interval": 1},
}  # fmt: skip
"""What AMCL's parameters are by default under each name."""


class Amcl(Ranged, LocalizerSpec):
    """Particle-filter localisation: nav2_amcl's parameters (Thrun et al., Probabilistic Robotics, ch. 8)."""

    component: ClassVar[str] = "simscen.stack.localizers.build:amcl"
    type: Literal["amcl"] = "amcl"
    parameters: Literal["default", "nav2", "consistent"] = "default"
    """What all else is where it is not said: as here; exactly as in nav2_amcl; or so that the covariance is true."""
    robot_model: Literal["differential", "omni"] | None = None
    """Motion model; default: as the robot's drive."""
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
    """The fewest that KLD sampling may leave."""
    max_particles: Annotated[int, Field(ge=10, le=50_000)] = 2000
    """The most, and as many as it begins with."""
    pf_err: Annotated[float, Field(gt=0, lt=1), Quantity("ratio")] = 0.05
    """KLD: greatest distance between the true and the sampled distribution."""
    pf_z: Annotated[float, Field(gt=0, lt=1)] = 0.99
    """KLD: upper quantile of the standard normal distribution, used as it is, as Nav2 does."""
    update_min_d: NonNegativeLength = 0.25
    """How far the robot must have moved until it looks at another scan."""
    update_min_a: Annotated[NonNegativeAngle, Field(le=6.3)] = 0.2
    """How far it must have turned until it looks at another scan."""
    sure_update_interval: Annotated[int, Field(ge=1, le=10)] = 2
    """Scans looked at for each that is compared with the map, while the robot is sure of its place: the map shows what
    the last one saw, the particles are one narrow group, and scans and wheels say the same of how it moved. The others
    show that alone. 1 = each, as in Nav2, and always so with `covariance: scatter`."""
    resample_interval: Annotated[int, Field(ge=1, le=100)] = 1
    """Scans looked at for each resampling."""
    max_beams: Annotated[int, Field(ge=2, le=4096)] = 60
    """How many beams of a scan are compared with the map."""
    laser_model_type: Literal["likelihood_field", "likelihood_field_prob", "beam"] = "likelihood_field_prob"
    """Nav2's default is `likelihood_field`, which forgives more and knows less."""
    z_hit: Probability = 0.5
    """Weight of beams that end at an obstacle of the map."""
    z_short: Probability = 0.05
    """Weight of beams that end before it; the `beam` model only."""
    z_max: Probability = 0.05
    """Weight of beams without an answer; the `beam` model only."""
    z_rand: Probability = 0.5
    """Weight of beams that end anywhere."""
    sigma_hit: Annotated[Length, Field(ge=0.001)] = 0.1
    """Standard deviation of the ends of beams that hit an obstacle of the map."""
    lambda_short: Annotated[float, Field(gt=0, le=100)] = 0.1
    """How fast short beams get rarer with their length, for each metre; the `beam` model only."""
    laser_likelihood_max_dist: PositiveLength = 2.0
    """Ends further from any obstacle than this count as that far."""
    laser_min_range: Length = -1.0
    """-1 = the lidar's own."""
    laser_max_range: Length = 100.0
    """Ranges are cut here, and at the lidar's own greatest one; -1 = at the lidar's own."""
    recovery_alpha_slow: Probability = 0.0
    """Decay of the slow average of weights, by which random particles are added; 0 = never."""
    recovery_alpha_fast: Probability = 0.0
    """Decay of the fast average of weights, by which random particles are added; 0 = never."""
    relocalization: Literal["scan_matching", "random"] = "scan_matching"
    """How a robot is found that does not know where it is, or is wrong about it: the last metres' scans are matched
    with the whole map; or only as Nav2 does, by particles anywhere at the start and by `recovery_alpha_*`."""
    likelihood_exponent: Annotated[float, Field(gt=0, le=1)] = 0.3
    """Of the product over the beams, which err together and so say less than as many would; `likelihood_field_prob`
    only."""
    beams_beyond_the_map: Literal["say_nothing", "miss"] = "say_nothing"
    """What beams tell that end where the map ends, in unknown space next to free space or off it; in Nav2 they miss.
    `likelihood_field_prob` only."""
    map_trust_none: Probability = 0.45
    """Up to this share of its beams that end near what the map shows a scan counts for nothing, as long as the
    particles are one narrow group: rooms are rebuilt, and nobody draws the map anew."""
    map_trust_full: Probability = 0.8
    """From this share on it counts in full, in between in proportion; 0 = it always does, as in Nav2."""
    settling_distance: NonNegativeLength = 4.0
    """Over so many metres from a place that was told, turns of 2 rad counting as one, scans count more and more, from a
    fifth on: what one room shows fits many places. 0 = in full at once, as in Nav2."""
    match_scans: bool = True
    """Correct each step of odometry by how the scan fits those of the last metres, where these can tell."""
    covariance: Literal["particles", "scatter"] = "particles"
    """What the covariance is told from: the particles, as in Nav2, or also how the poses of the last metres scatter
    about the way that the robot saw itself go, and how far off the beams are, for particles all err together; that
    with `match_scans` only."""
    selective_resampling: bool = False
    """Resample only when the effective number of particles is below half of them."""
    do_beamskip: bool = False
    """Leave out beams that fit hardly any particle; `likelihood_field_prob` only."""
    beam_skip_distance: PositiveLength = 0.5
    """A beam fits a particle when it ends this near to an obstacle of the map."""
    beam_skip_threshold: Probability = 0.3
    """Beams that fit a smaller share of the particles are left out."""
    beam_skip_error_threshold: Probability = 0.9
    """Where so great a share of the beams would be left out, none is: then it is the pose that is wrong."""

    @model_validator(mode="before")
    @classmethod
    def _filled_in(cls, values: Any) -> Any:
        """With what `parameters` names; what is said wins."""
        named = values.get("parameters") if isinstance(values, Mapping) else None
        chosen = AMCL_PARAMETERS.get(named) if isinstance(named, str) else None
        return {**chosen, **values} if chosen else values

    @property
    def farthest(self) -> float:
        """Where ranges are cut, if the lidar's own greatest one is not less; nothing above zero is the lidar's own."""
        return self.laser_max_range if self.laser_max_range > 0.0 else math.inf


class Ekf(LocalizerSpec):
    """Odometry and gyroscope in an extended Kalman filter; no map, so it drifts."""

    component: ClassVar[str] = "simscen.stack.localizers.build:ekf"
    fuses_odometry: ClassVar[bool] = True
    type: Literal["ekf"]
    translation_noise: Annotated[NonNegativeLength, Field(le=100)] = 0.02
    """Standard deviation of the position after one metre."""
    rotation_noise: NonNegativeAngle = 0.02
    """Standard deviation of the heading after one rad or one metre."""
    gyro_noise: NonNegativeAngularSpeed = 0.005
    """Standard deviation of the turn rate."""
    gyro_bias: NonNegativeAngularSpeed | None = None
    """Standard deviation of the gyroscope's bias at the start; default: as `gyro_noise`."""
    gyro_bias_walk: NonNegativeAngularSpeed = 0.0001
    """Standard deviation of how far the bias has wandered after a second."""
    wheel_slip: Probability = 0.0
    """Standard deviation of the share of its way by which a robot slips; a slip lasts about a second."""
    match_scans: bool = False
    """Correct how far odometry says that the robot came by how each scan fits those of the last metres: a laser scan
    matcher beside wheels and gyroscope. The covariance stays that of the wheels."""


class GroundTruth(LocalizerSpec):
    """The true pose, to tell faults of localisation from faults of navigation."""

    component: ClassVar[str] = "simscen.stack.localizers.build:ground_truth"
    type: Literal["ground_truth"]


class OdometryOnly(LocalizerSpec):
    """Dead reckoning from the start pose."""

    component: ClassVar[str] = "simscen.stack.localizers.build:odometry"
    type: Literal["odometry"]


_Localizers = Annotated[
    Annotated[Amcl, Tag("amcl")]
    | Annotated[Ekf, Tag("ekf")]
    | Annotated[GroundTruth, Tag("ground_truth")]
    | Annotated[OdometryOnly, Tag("odometry")],
    Discriminator(type_discriminator("amcl")),
]


Localizer = Annotated[LocalizerSpec, ByType("localizer", _Localizers)]


_HERE = "simscen.model.localizers:"
LOCALIZERS = {
    "amcl": _HERE + "Amcl",
    "ekf": _HERE + "Ekf",
    "ground_truth": _HERE + "GroundTruth",
    "odometry": _HERE + "OdometryOnly",
}
