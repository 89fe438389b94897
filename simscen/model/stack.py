"""The navigation stack's parameters, with Nav2's names and defaults."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Discriminator, Field, Tag, model_validator

from simscen.core.navigation import RecoveryBehavior
from simscen.model.controllers import Controller
from simscen.model.latency import Latency
from simscen.model.profiles import PROFILES, Profile, with_profile
from simscen.model.stackbase import GoalTolerances, StackBase
from simscen.spec.base import Ranged, Spec, by_default, type_or
from simscen.spec.bytype import ByType
from simscen.spec.component import Typed
from simscen.spec.quantities import (
    Angle,
    Duration,
    Frequency,
    Length,
    NonNegativeAngle,
    NonNegativeAngularSpeed,
    NonNegativeLength,
    PositiveAcceleration,
    PositiveAngularAcceleration,
    PositiveAngularSpeed,
    PositiveDuration,
    PositiveLength,
    PositiveSpeed,
    Probability,
    Quantity,
)

Patience = Annotated[float, Field(ge=-1, le=86400), Quantity("duration")]
PlannerCode = Literal[
    "PLANNER_UNKNOWN",
    "START_OUTSIDE_MAP",
    "GOAL_OUTSIDE_MAP",
    "START_OCCUPIED",
    "GOAL_OCCUPIED",
    "PLANNER_TIMEOUT",
    "NO_VALID_PATH",
]
"""Codes with which a planner fails."""
ParameterFile = Annotated[str, Field(min_length=1, max_length=4096)]
Noise = Annotated[float, Field(ge=0, le=100)]
Iterations = Annotated[int, Field(ge=1, le=1_000_000)]


class LocalizerSpec(Typed):
    """What knows where the robot is."""


AMCL_PARAMETERS: Mapping[str, Mapping[str, object]] = {
    "default": {},
    "nav2": {
        "laser_model_type": "likelihood_field", "sigma_hit": 0.2, "likelihood_exponent": 1.0,
        "beams_beyond_the_map": "miss", "map_trust_none": 0.0, "map_trust_full": 0.0,
        "match_scans": False, "relocalization": "random",
    },
    "consistent": {
        "alpha1": 0.0005, "alpha2": 0.0005, "alpha3": 0.0005, "alpha4": 0.0005, "alpha5": 0.0005,
        "likelihood_exponent": 1.0, "map_trust_none": 0.85, "map_trust_full": 1.0,
    },
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
    match_scans: bool = True
    """Correct each step of odometry by how the scan fits those of the last metres, where these can tell."""
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
    Discriminator(type_or("amcl")),
]
Localizer = Annotated[LocalizerSpec, ByType("localizer", _Localizers)]


class DenoiseLayer(Spec):
    """nav2_costmap_2d's denoise layer: obstacles of very few cells are noise, and left out."""

    enabled: bool = False
    """Whether it is there at all."""
    minimal_group_size: Annotated[int, Field(ge=1, le=1000)] = 2
    """Groups of fewer cells are left out."""
    group_connectivity_type: Literal[4, 8] = 8
    """Whether cells that touch at a corner are of one group: 8, or 4 where only edges join."""


class Costmap(Ranged):
    """The global costmap (nav2_costmap_2d: static, obstacle and inflation layers), in the map frame, for plans."""

    resolution: PositiveLength = 0.05
    """Edge of the largest cell: those of a coarser map are split, those of a finer one stay as they are."""
    inflation_radius: NonNegativeLength = 0.70
    """How far around obstacles cells cost something."""
    cost_scaling_factor: Annotated[float, Field(gt=0, le=100)] = 3.0
    """How fast cost falls with the distance to an obstacle, for each metre."""
    update_frequency: Frequency = 5.0
    """How often what the lidars see is taken in."""
    obstacle_max_range: PositiveLength = 2.5
    """What is seen further off is not marked."""
    obstacle_min_range: NonNegativeLength = 0.0
    """What is seen nearer is not marked."""
    raytrace_max_range: PositiveLength = 3.0
    """Beams clear cells up to this distance."""
    raytrace_min_range: NonNegativeLength = 0.0
    """Beams clear cells from this distance on."""
    min_obstacle_height: NonNegativeLength = 0.05
    """Of what a camera sees, lower things are the ground. Lidars see at their own height, whatever this says."""
    max_obstacle_height: NonNegativeLength = 2.0
    """Of what a camera sees, higher things are not in the way."""
    inf_is_valid: bool = True
    """Whether beams that meet nothing clear what they pass through. Nav2's default is that they say nothing."""
    denoise_layer: DenoiseLayer = by_default()
    """What is done about single cells."""
    track_unknown_space: bool = True
    """Whether what the map does not know, and no beam has passed through, is unknown; else it is free."""
    rolling_size: PositiveLength = 24.0
    """Edge of the rolling window when driving without a map."""


class LocalCostmap(Spec):
    """The local costmap, which rolls with the robot in the odom frame, for controllers and behaviours.

    It shows what the sensors see and keepout zones, and no map. What is not said here is as in `costmap`.
    """

    width: PositiveLength | None = None
    """Along x of the odom frame; default: what the controller looks ahead at full speed, at least 3 m."""
    height: PositiveLength | None = None
    """Along y of the odom frame; default: as for the width."""
    resolution: PositiveLength | None = None
    """Edge of a cell."""
    inflation_radius: NonNegativeLength | None = None
    """How far around obstacles cells cost something."""
    cost_scaling_factor: Annotated[float, Field(gt=0, le=100)] | None = None
    """How fast cost falls with the distance to an obstacle, for each metre."""
    update_frequency: Frequency | None = None
    """How often what the sensors see is taken in."""
    obstacle_max_range: PositiveLength | None = None
    """What is seen further off is not marked."""
    obstacle_min_range: NonNegativeLength | None = None
    """What is seen nearer is not marked."""
    raytrace_max_range: PositiveLength | None = None
    """Beams clear cells up to this distance."""
    raytrace_min_range: NonNegativeLength | None = None
    """Beams clear cells from this distance on."""
    min_obstacle_height: NonNegativeLength | None = None
    """Of what a camera sees, lower things are the ground."""
    max_obstacle_height: NonNegativeLength | None = None
    """Of what a camera sees, higher things are not in the way."""
    inf_is_valid: bool | None = None
    """Whether beams that meet nothing clear what they pass through."""
    denoise_layer: DenoiseLayer | None = None
    """What is done about single cells."""
    track_unknown_space: bool = False
    """Whether what no beam has passed through is unknown; else it is free."""

    def completed(self, shared: Costmap) -> Costmap:
        """The costmap with what it does not say itself from `shared`."""
        own = {name: value for name in sorted(Costmap.model_fields) if (value := getattr(self, name, None)) is not None}
        return shared.model_copy(update=own)


class PlannerSpec(Typed):
    """What finds a way, and when it is asked for another one."""

    tolerance: NonNegativeLength = 0.5
    """How far from an unreachable goal the plan may end."""
    replanning: Literal["on_invalid", "rate"] = "on_invalid"
    """Replan when the plan is blocked or clearly worse than a new one, or at a rate."""
    replanning_rate: Frequency | None = None
    """How often, with `replanning: rate`; default: 1 Hz, through poses 0.333 Hz, as in Nav2's trees."""
    cautious: bool = True
    """Whether, once a plan could not be followed, roomier ways are taken where there are some. Nav2 does not."""


class OmplPlanner(PlannerSpec):
    """A planner of OMPL on the costmap."""

    component: ClassVar[str] = "simscen.stack.planners.build:ompl_planner"
    type: Literal["bit_star", "rrt_connect", "rrt_star", "informed_rrt_star", "aorrtc", "kpiece"] = "bit_star"
    allow_unknown: bool = True
    """Whether plans may lead over what is not known, as dear as what is barely free."""
    cost_travel_multiplier: Annotated[float, Field(ge=0, le=100)] = 2.0
    """A metre of way costs 1 + this times its cost / 252 (nav2_smac_planner's name and meaning; its default is 1)."""
    sampler: Literal["auto", "uniform", "medial_axis", "corridor"] = "auto"
    """Where it searches; auto: medial_axis for bit_star, which alone can, else uniform."""
    max_iterations: Iterations = 50_000
    """Iterations of a search before it is given up; never seconds."""
    improving_iterations: Iterations = 500
    """Iterations of planners that improve their path, when they draw the samples themselves."""
    simplify: bool = True
    """Whether the path that OMPL found is moved to where it costs least, and smoothed."""
    state_space: Literal["auto", "holonomic", "se2", "dubins", "reeds_shepp"] = "auto"
    """auto: Reeds-Shepp for an Ackermann drive, se2 for a long footprint, else holonomic."""

    @model_validator(mode="after")
    def _sampled(self) -> "OmplPlanner":
        if self.sampler == "medial_axis" and self.type != "bit_star":
            raise ValueError(f"`sampler: medial_axis` is for `bit_star`; `{self.type}` draws its samples itself")
        return self


class Navfn(PlannerSpec):
    """nav2_navfn_planner: the cheapest way over the cells of the costmap, by Dijkstra."""

    component: ClassVar[str] = "simscen.stack.planners.grid_planner:navfn"
    type: Literal["navfn"]
    allow_unknown: bool = True
    """Whether plans may lead over what is not known, as dear as what is barely free."""


class Smac2d(PlannerSpec):
    """nav2_smac_planner::SmacPlanner2D: the cheapest way from cell to neighbouring cell."""

    component: ClassVar[str] = "simscen.stack.planners.grid_planner:smac_2d"
    type: Literal["smac_2d"]
    tolerance: NonNegativeLength = 0.125
    """How far from an unreachable goal the plan may end."""
    allow_unknown: bool = True
    """Whether plans may lead over what is not known, as dear as what is barely free."""
    cost_travel_multiplier: Annotated[float, Field(ge=0, le=100)] = 1.0
    """A metre of way costs 1 + this times its cost / 252."""
    smooth_path: bool = True
    """Whether the corners of the cells are taken out of the path."""


def _planner(value: Any) -> str | None:
    kind = value.get("type", "bit_star") if isinstance(value, dict) else getattr(value, "type", None)
    return kind if kind in ("navfn", "smac_2d") else "ompl"


_Planners = Annotated[
    Annotated[OmplPlanner, Tag("ompl")] | Annotated[Navfn, Tag("navfn")] | Annotated[Smac2d, Tag("smac_2d")],
    Discriminator(_planner),
]
Planner = Annotated[PlannerSpec, ByType("planner", _Planners)]


class GoalCheckerSpec(GoalTolerances, Typed):
    """What says whether a goal is reached; the tolerances are those of goals that name none."""


class SimpleGoalChecker(GoalCheckerSpec):
    """nav2_controller::SimpleGoalChecker."""

    component: ClassVar[str] = "simscen.stack.goal_checker:SimpleGoalChecker"
    type: Literal["simple"] = "simple"
    stateful: bool = True
    """Once the position was reached only the heading counts."""
    well_inside: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 0.5
    """While it moves, the robot has arrived within this share of the tolerances; at rest, anywhere inside. Nav2: 1."""


GoalChecker = Annotated[GoalCheckerSpec, ByType("goal_checker", SimpleGoalChecker)]


class ProgressChecker(Spec):
    """nav2_controller::SimpleProgressChecker, or PoseProgressChecker when an angle is given."""

    required_movement_radius: PositiveLength = 0.5
    """How far it must move within the time allowed."""
    required_movement_angle: Angle | None = None
    """Or how far it must turn, where that counts as progress."""
    movement_time_allowance: PositiveDuration = 10.0
    """In how long; then driving fails with FAILED_TO_MAKE_PROGRESS."""


class BehaviorSpec(Typed):
    """What a robot does when planning or control has failed."""

    turns_in_place: ClassVar[bool] = False
    """Whether only a base that turns in place can do it; others leave it out."""


class Spin(BehaviorSpec):
    """Turn in place, to see what is around (nav2_behaviors::Spin)."""

    component: ClassVar[str] = "simscen.stack.behaviors.motions:Spin"
    turns_in_place: ClassVar[bool] = True
    type: Literal["spin"] = "spin"
    spin_dist: Angle = 1.57
    """How far it turns."""
    max_rotational_vel: PositiveAngularSpeed = 1.0
    """Greatest turn rate of a spin."""
    simulate_ahead_time: PositiveDuration = 2.0
    """How far ahead it looks for collisions."""


class Wait(BehaviorSpec):
    """Stand still: what is in the way may go by itself (nav2_behaviors::Wait)."""

    component: ClassVar[str] = "simscen.stack.behaviors.motions:Wait"
    type: Literal["wait"] = "wait"
    wait_duration: Duration = 5.0
    """How long it waits."""


class BackUp(BehaviorSpec):
    """Drive straight back (nav2_behaviors::BackUp)."""

    component: ClassVar[str] = "simscen.stack.behaviors.motions:BackUp"
    type: Literal["backup"] = "backup"
    backup_dist: NonNegativeLength = 0.30
    """How far it backs up."""
    backup_speed: PositiveSpeed = 0.15
    """How fast it backs up."""
    simulate_ahead_time: PositiveDuration = 2.0
    """How far ahead it looks for collisions."""
    backup_partial: bool = True
    """Whether it backs up as far as there is room, where that is less; often it is enough to turn. Nav2 does not."""


class ClearCostmap(BehaviorSpec):
    """Forget live obstacles that are not seen any more."""

    component: ClassVar[str] = "simscen.stack.behaviors.motions:ClearCostmap"
    type: Literal["clear_costmap"] = "clear_costmap"
    clear_entirely: bool = False
    """Whether all of the global costmap is cleared, as in Nav2, or as much as the local one reaches."""


_Behaviors = Annotated[
    Annotated[Spin, Tag("spin")]
    | Annotated[Wait, Tag("wait")]
    | Annotated[BackUp, Tag("backup")]
    | Annotated[ClearCostmap, Tag("clear_costmap")],
    Field(discriminator="type"),
]
_NamedOrWhole = Annotated[
    Annotated[RecoveryBehavior, Tag("a name")] | Annotated[_Behaviors, Tag("a behaviour")],
    Discriminator(lambda value: "a name" if isinstance(value, str) else "a behaviour"),
]
Behavior = Annotated[str | BehaviorSpec, ByType("behavior", _NamedOrWhole, named=True)]


class Recovery(Spec):
    """Behaviours of Nav2's default tree, taken in turn when planning or control fails."""

    number_of_retries: Annotated[int, Field(ge=0, le=100)] = 6
    """How often a goal is tried again before it fails."""
    planner_codes: Annotated[list[PlannerCode], Field(max_length=20)] = [
        "PLANNER_UNKNOWN",
        "START_OUTSIDE_MAP",
        "START_OCCUPIED",
        "GOAL_OCCUPIED",
        "PLANNER_TIMEOUT",
        "NO_VALID_PATH",
    ]
    """After which failures to plan that is done (WouldAPlannerRecoveryHelp); after others the goal fails at once.
    Nav2 gives up where start or goal are occupied, though what occupies them may go."""
    behaviors: Annotated[list[Behavior], Field(max_length=20)] = [
        "clear_costmap",
        "spin",
        "wait",
        "backup",
    ]
    """What is done in turn, by name or with parameters of its own."""
    clear_entirely: bool = False
    """Whether all of the global costmap is cleared, as in Nav2, or as much as the local one reaches: a dead end that is
    forgotten is driven into again."""
    spin_dist: Angle = 1.57
    """How far it turns."""
    wait_duration: Duration = 5.0
    """How long it waits."""
    backup_dist: NonNegativeLength = 0.30
    """How far it backs up."""
    backup_speed: PositiveSpeed = 0.15
    """How fast it backs up."""
    backup_partial: bool = True
    """Whether it backs up as far as there is room, where that is less; often it is enough to turn. Nav2 does not."""
    simulate_ahead_time: PositiveDuration = 2.0
    """How far ahead it looks for collisions."""
    max_rotational_vel: PositiveAngularSpeed = 1.0
    """Greatest turn rate of a spin."""

    @property
    def names(self) -> list[str]:
        """What the behaviours are called, in turn."""
        return [entry if isinstance(entry, str) else entry.type for entry in self.behaviors]

    def chosen(self) -> list[BehaviorSpec]:
        """The behaviours in turn; each takes what it does not say itself from the parameters of the same name here."""
        return [self._completed(entry) for entry in self.behaviors]

    def _completed(self, entry: str | BehaviorSpec) -> BehaviorSpec:
        model = _SHIPPED[entry] if isinstance(entry, str) else type(entry)
        shared = type(self).model_fields.keys() & model.model_fields.keys()
        own = {} if isinstance(entry, str) else {name: getattr(entry, name) for name in entry.model_fields_set}
        return model.model_validate({**{name: getattr(self, name) for name in sorted(shared)}, **own})


_SHIPPED: dict[str, type[BehaviorSpec]] = {
    "clear_costmap": ClearCostmap,
    "spin": Spin,
    "wait": Wait,
    "backup": BackUp,
}


class VelocitySmoother(Spec):
    """nav2_velocity_smoother: limits accelerations of what is sent to the base."""

    enabled: bool = True
    """Whether it is there at all."""
    max_accel: PositiveAcceleration | None = None
    """Default: the robot's own limit."""
    max_angular_accel: PositiveAngularAcceleration | None = None
    """Default: the robot's own limit."""
    max_decel: PositiveAcceleration | None = None
    """Default: the robot's own limit."""
    max_velocity: PositiveSpeed | None = None
    """Of each component of its velocity; default: what the controller commands."""
    max_angular_velocity: PositiveAngularSpeed | None = None
    """Of its turn rate; default: what the controller commands."""


class CollisionMonitor(Spec):
    """nav2_collision_monitor: the last word before the base."""

    enabled: bool = True
    """Whether it is there at all."""
    source_timeout: PositiveDuration = 0.3
    """A lidar that is silent this long stops the robot (Nav2's default is 1 s)."""
    time_before_collision: PositiveDuration = 0.5
    """APPROACH: slow down so that a collision is at least this far off."""
    stop_margin: NonNegativeLength = 0.02
    """STOP: nothing may be nearer to the footprint than this, in the direction of travel. Nav2 has no such margin."""
    min_points: Annotated[int, Field(ge=1, le=1000)] = 1
    """How many points of a scan there must be in the way. Nav2's default is 4: a chair's leg may be fewer."""
    hold_timeout: Duration = 1.0
    """How long it may hold the robot until that counts as a failure, for the controller may not see what it sees; 0:
    never, as in Nav2, where the progress checker says so in the end."""


_LatencyOrRobots = Annotated[
    Annotated[Literal["robot"], Tag("a name")] | Annotated[Latency, Tag("durations")],
    Discriminator(lambda value: "a name" if isinstance(value, str) else "durations"),
]


class Prediction(Ranged):
    """Motion prediction: what moves is tracked from the lidars' scans and met where it will be."""

    enabled: bool = True
    """Whether it is there at all."""
    max_range: PositiveLength = 12.0
    """Nothing further off is tracked."""
    max_radius: PositiveLength = 1.0
    """Larger things are taken for walls."""
    min_speed: PositiveSpeed = 0.25
    """What is slower stands."""
    acceleration: PositiveAcceleration = 1.5
    """Standard deviation of how fast a tracked thing changes its velocity."""
    margin: NonNegativeLength = 0.15
    """Hits so near to the cylinder of a moving thing are its own, and not marked in costmaps."""


class InProcessStack(StackBase, Typed):
    """A whole stack that lives in the process of its run: simscen's own, or one that an installed package adds."""


class StackSpec(InProcessStack):
    """The navigation stack under test: Nav2 in miniature."""

    component: ClassVar[str] = "simscen.stack.build:reference_stack"
    type: Literal["reference"] = "reference"
    profile: Profile = "simscen"
    """Where parameters have their values from that nobody says: our own defaults, or exactly Nav2's."""
    nav2_params: ParameterFile | None = None
    """A parameter file of Nav2, such as nav2_params.yaml: what it says of parameters that are here, too."""
    localizer: Localizer = by_default()
    """What knows where the robot is."""
    costmap: Costmap = by_default()
    """What the robot knows of the ground, for plans; the local costmap takes from it what it does not say itself."""
    local_costmap: LocalCostmap = by_default()
    """What the robot sees around it, for driving."""
    planner: Planner = by_default()
    """What finds a way."""
    controller: Controller = by_default()
    """What follows a path."""
    failure_tolerance: Patience = 0.3
    """How long the controller may find no valid command until that is PATIENCE_EXCEEDED; at 0 it is NO_VALID_CONTROL at
    once, with -1 it never fails."""
    goal_checker: GoalChecker = by_default()
    """What says whether a goal is reached."""
    progress_checker: ProgressChecker = by_default()
    """What says that the robot does not get on."""
    recovery: Recovery = by_default()
    """What is done when planning or control has failed."""
    velocity_smoother: VelocitySmoother = by_default()
    """What limits the accelerations of commands."""
    collision_monitor: CollisionMonitor = by_default()
    """What stops the robot, whatever it is told."""
    latency: _LatencyOrRobots = by_default()
    """What computing takes: durations, or `robot` for what the robot's file says, of its sensors, too."""
    prediction: Prediction = by_default()
    """What knows of things that move, and keeps out of their way."""

    @model_validator(mode="before")
    @classmethod
    def _by_profile(cls, said: Any) -> Any:
        return with_profile(said) if isinstance(said, Mapping) and said.get("profile") in PROFILES else said

    @property
    def told_truth(self) -> bool:
        """Whether its localizer is told where the robot truly is."""
        return isinstance(self.localizer, GroundTruth)


_HERE = "simscen.model.stack:"
LOCALIZERS = {
    "amcl": _HERE + "Amcl",
    "ekf": _HERE + "Ekf",
    "ground_truth": _HERE + "GroundTruth",
    "odometry": _HERE + "OdometryOnly",
}
PLANNERS = {
    **dict.fromkeys(get_args(OmplPlanner.model_fields["type"].annotation), _HERE + "OmplPlanner"),
    "navfn": _HERE + "Navfn",
    "smac_2d": _HERE + "Smac2d",
}
BEHAVIORS = {
    "clear_costmap": _HERE + "ClearCostmap",
    "spin": _HERE + "Spin",
    "wait": _HERE + "Wait",
    "backup": _HERE + "BackUp",
}
GOAL_CHECKERS = {"simple": _HERE + "SimpleGoalChecker"}
STACKS = {"reference": _HERE + "StackSpec"}
