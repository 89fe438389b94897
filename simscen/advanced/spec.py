"""Specifications of the advanced localizers, the advanced planner, and the advanced recovery behavior.

pyproject.toml registers them as entry points, as a plug-in does.
"""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from simscen.model.localizers import AmclParameters, EkfParameters
from simscen.model.planners import OmplParameters
from simscen.model.recovery import BehaviorSpec
from simscen.spec.quantities import Length, NonNegativeLength, PositiveDuration, PositiveSpeed, Probability

PARAMETER_SETS: Mapping[str, Mapping[str, object]] = {
    "default": {},
    "consistent": {"covariance": "scatter", "sure_update_interval": 1},
}
"""Values that replace defaults of ScanMatchingAmcl, by the name of the parameter set."""


class ScanMatchingAmcl(AmclParameters):
    """AMCL with scan matching, relocalization, and less trust in an outdated map. Also has the parameters of `amcl`."""

    component: ClassVar[str] = "simscen.advanced.localizers.build:scan_matching_amcl"
    precomputation: ClassVar[str] = "simscen.advanced.localizers.build:precompute"
    type: Literal["scan_matching_amcl"] = "scan_matching_amcl"
    parameters: Literal["default", "consistent"] = "default"
    """Set of default values. `consistent` estimates a covariance that agrees with the true error."""
    sigma_hit: Annotated[Length, Field(ge=0.001)] = 0.1
    """Standard deviation of the endpoints of beams that hit an obstacle of the map."""
    match_scans: bool = True
    """Predict the motion by matching each scan with earlier scans, with odometry as the initial guess."""
    likelihood_exponent: Annotated[float, Field(gt=0, le=1)] = 0.3
    """Exponent of the likelihood of a scan, which is the product of the likelihoods of its beams. It is below 1 because
    the errors of neighboring beams are similar. `likelihood_field_prob` only."""
    beams_beyond_the_map: Literal["say_nothing", "miss"] = "say_nothing"
    """Whether beams that end outside the map, or in unknown space next to free space, are ignored (`say_nothing`) or
    count as a miss, as in Nav2. `likelihood_field_prob` only."""
    map_trust_none: Probability = 0.45
    """A scan is ignored if at most this share of its beams fits the map. This applies only while the particles are one
    narrow cluster. The pose is then probably right, and the surroundings have changed."""
    map_trust_full: Probability = 0.8
    """A scan has its full weight if at least 80 % of its beams end on the mapped area, and at least this share of the
    beams that end there fits the map. 0 = full weight of all scans, as in Nav2; `sure_update_interval` then has no
    effect."""
    settling_distance: NonNegativeLength = 4.0
    """The weight of scans after a given initial pose starts at a fifth, and grows by 1 / `settling_distance` per meter
    up to its full value. Meanwhile, the pose is also searched near the initial one. Early scans count less
    because one room alone fits many poses. A turn of 2 rad counts as 1 m. 0 = full weight at once, as in Nav2."""
    relocalization: Literal["scan_matching", "random"] = "scan_matching"
    """How a lost robot is found. `scan_matching`: by matching the scans of the last meters with the whole map.
    `random`: by random particles, which `recovery_alpha_*` adds as in Nav2. `scan_matching` ignores
    `recovery_alpha_*`, because random particles at a similar place would draw the filter away from a correct pose."""
    sure_update_interval: Annotated[int, Field(ge=1, le=10)] = 2
    """While map, scan matching, and odometry agree, only every n-th scan is compared with the map. The others are only
    matched with earlier scans. With `covariance: scatter`, every scan is compared with the map."""
    covariance: Literal["particles", "scatter"] = "particles"
    """Covariance of the pose. `particles`: the covariance of the particles, as in Nav2. `scatter`: this covariance,
    scaled by the residuals of the beams and the scatter of recent poses. `scatter` needs `match_scans`."""

    @model_validator(mode="before")
    @classmethod
    def _with_parameter_set(cls, values: Any) -> Any:
        """Fill in values of the chosen parameter set for parameters that are not given."""
        name = values.get("parameters") if isinstance(values, Mapping) else None
        chosen = PARAMETER_SETS.get(name) if isinstance(name, str) else None
        return {**chosen, **values} if chosen else values

    @model_validator(mode="after")
    def _check_map_trust(self) -> "ScanMatchingAmcl":
        if 0 < self.map_trust_full <= self.map_trust_none:
            raise ValueError(
                f"`map_trust_none` {self.map_trust_none:g} must be less than `map_trust_full` {self.map_trust_full:g}"
            )
        return self


class SlipEkf(EkfParameters):
    """EKF of odometry and gyroscope that detects wheel slip in turns, with optional scan matching. Uses no map."""

    component: ClassVar[str] = "simscen.advanced.localizers.build:slip_ekf"
    type: Literal["slip_ekf"]
    wheel_slip: Probability = 0.0
    """Standard deviation of slip, as a share of the distance driven. Slip changes within about one second."""
    match_scans: bool = False
    """Correct the distance by matching each scan with earlier scans. The corrections do not change the covariance."""


class MedialAxisPlanner(OmplParameters):
    """BIT* on samples of the medial axis near the cheapest path over a coarse grid. The path is then optimized.

    For cars and long robots: RRT-Connect over poses in the region of near-shortest paths over a coarse grid.
    """

    component: ClassVar[str] = "simscen.advanced.planners.medial_axis_planner:medial_axis_planner"
    type: Literal["medial_axis"]


class Retrace(BehaviorSpec):
    """Drive back along the path that the robot has driven, until there is room to turn. Nav2 has no such behavior.

    The robot backs up straight if this path is not known.
    """

    component: ClassVar[str] = "simscen.advanced.retrace:Retrace"
    type: Literal["retrace"] = "retrace"
    backup_dist: NonNegativeLength = 0.30
    """Minimum distance to drive back."""
    retrace_dist: NonNegativeLength = 1.0
    """Maximum distance to drive back. After `backup_dist`, the behavior ends once there is room to turn in place."""
    backup_speed: PositiveSpeed = 0.15
    """Speed of driving back."""
    time_allowance: PositiveDuration = 10.0
    """Time after which the behavior fails with BACKUP_TIMEOUT, but at least 1.5 times the duration of driving
    `retrace_dist` at `backup_speed`."""
