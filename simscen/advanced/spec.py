"""Parameters of the advanced localizers and of the advanced planner."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from simscen.model.localizers import AmclParameters, EkfParameters
from simscen.model.planners import OmplParameters
from simscen.spec.quantities import Length, NonNegativeLength, Probability

PARAMETER_SETS: Mapping[str, Mapping[str, object]] = {
    "default": {},
    "consistent": {"covariance": "scatter", "sure_update_interval": 1},
}
"""Default values by the name of a parameter set."""


class ScanMatchingAmcl(AmclParameters):
    """AMCL with scan matching, relocalization search and map trust. Takes all parameters of `amcl`, too."""

    component: ClassVar[str] = "simscen.advanced.localizers.build:scan_matching_amcl"
    precomputation: ClassVar[str] = "simscen.advanced.localizers.build:precompute"
    type: Literal["scan_matching_amcl"] = "scan_matching_amcl"
    parameters: Literal["default", "consistent"] = "default"
    """Set of default values. `consistent` estimates a covariance that agrees with the true error."""
    sigma_hit: Annotated[Length, Field(ge=0.001)] = 0.1
    """Standard deviation of the endpoints of beams that hit an obstacle of the map."""
    match_scans: bool = True
    """Predict the motion by matching each scan with those of the last meters, with odometry as the initial guess."""
    likelihood_exponent: Annotated[float, Field(gt=0, le=1)] = 0.3
    """Exponent of the product over the beams. Below 1 because beams err together; `likelihood_field_prob` only."""
    beams_beyond_the_map: Literal["say_nothing", "miss"] = "say_nothing"
    """Whether beams that end outside the map, or in unknown space next to free space, are ignored (`say_nothing`) or
    count as a miss, as in Nav2. `likelihood_field_prob` only."""
    map_trust_none: Probability = 0.45
    """A scan is ignored if no more than this share of its beams fits the map, while the particles are one narrow group:
    the robot is where it is believed to be, and its surroundings have changed."""
    map_trust_full: Probability = 0.8
    """A scan has its full weight if at least this share of its beams fits the map; 0 = every scan, as in Nav2."""
    settling_distance: NonNegativeLength = 4.0
    """Distance from a given initial pose over which the weight of scans grows from a fifth to its full value, since one
    room alone fits many poses. A turn of 2 rad counts as 1 m. 0 = full weight at once, as in Nav2."""
    relocalization: Literal["scan_matching", "random"] = "scan_matching"
    """How a lost robot is found: the scans of the last meters are matched with the whole map, or only random particles
    at the start and by `recovery_alpha_*` find it, as in Nav2. `scan_matching` ignores `recovery_alpha_*`, because
    random particles at poses that look alike would lead away from a correct pose."""
    sure_update_interval: Annotated[int, Field(ge=1, le=10)] = 2
    """Number of scans per comparison with the map while the robot is certain of its pose: map, scan matching and
    odometry agree. The other scans are only matched with each other. Always 1 with `covariance: scatter`."""
    covariance: Literal["particles", "scatter"] = "particles"
    """Source of the covariance: the particles, as in Nav2, or also the scatter of the last estimates about the matched
    motion and the residuals of the beams. `scatter` needs `match_scans`."""

    @model_validator(mode="before")
    @classmethod
    def _with_parameter_set(cls, values: Any) -> Any:
        """Fill in the values of the chosen parameter set; values that are given win."""
        name = values.get("parameters") if isinstance(values, Mapping) else None
        chosen = PARAMETER_SETS.get(name) if isinstance(name, str) else None
        return {**chosen, **values} if chosen else values


class SlipEkf(EkfParameters):
    """EKF of odometry and gyroscope that detects wheel slip in turns, with optional laser odometry. Uses no map."""

    component: ClassVar[str] = "simscen.advanced.localizers.build:slip_ekf"
    type: Literal["slip_ekf"]
    wheel_slip: Probability = 0.0
    """Standard deviation of the share of the distance by which the robot slips; a slip lasts about one second."""
    match_scans: bool = False
    """Correct the distance by matching each scan with those of the last meters. The covariance stays that of the
    wheels."""


class MedialAxisPlanner(OmplParameters):
    """BIT* on samples of the medial axis near the cheapest path over a coarse grid, then an optimization of the path.

    For cars and long hulls: RRT-Connect over poses, confined to near-shortest paths over a coarse grid.
    """

    component: ClassVar[str] = "simscen.advanced.planners.medial_axis_planner:medial_axis_planner"
    type: Literal["medial_axis"]
