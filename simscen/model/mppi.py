"""The parameters of MPPI and of its critics: nav2_mppi_controller's names, and the defaults of Nav2's own file."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from simscen.model.stack_base import ControllerSpec, Weight
from simscen.spec.base import Spec, by_default
from simscen.spec.quantities import (
    Duration,
    NonNegativeAngle,
    NonNegativeAngularSpeed,
    NonNegativeLength,
    NonNegativeSpeed,
    PositiveAcceleration,
    PositiveAngularAcceleration,
    PositiveAngularSpeed,
    PositiveDuration,
    PositiveLength,
    PositiveSpeed,
    Quantity,
    Speed,
)

Power = Annotated[int, Field(ge=1, le=10)]
Points = Annotated[int, Field(ge=0, le=1000)]
Every = Annotated[int, Field(ge=1, le=100)]
Deceleration = Annotated[float, Field(ge=-1000, lt=0), Quantity("acceleration")]
CriticName = Literal[
    "ConstraintCritic",
    "CostCritic",
    "ObstaclesCritic",
    "GoalCritic",
    "GoalAngleCritic",
    "PathAlignCritic",
    "PathFollowCritic",
    "PathAngleCritic",
    "PreferForwardCritic",
    "TwirlingCritic",
    "VelocityDeadbandCritic",
]


class MppiCritic(Spec):
    """What every critic has: cost = (`cost_weight` × what it measures) to the power of `cost_power`."""

    enabled: bool = True
    """Whether it is asked."""
    cost_power: Power = 1
    """How much worse twice as bad is."""


class MppiConstraintCritic(MppiCritic):
    """Against velocities that the base must not or cannot drive."""

    cost_weight: Weight = 4.0
    """Of m/s too many, over the seconds."""


class MppiCostCritic(MppiCritic):
    """Against obstacles, by the costs of the costmap."""

    cost_weight: Weight = 3.81
    """Of the mean cost, 254 being 1."""
    critical_cost: Weight = 300.0
    """Cost of a pose from `near_collision_cost` on."""
    near_collision_cost: Annotated[int, Field(ge=1, le=255)] = 253
    """A pose of this cost is all but a collision."""
    collision_cost: Weight = 1_000_000.0
    """Cost of a trajectory that hits something."""
    consider_footprint: bool | None = None
    """Whether the whole hull must be free, or its inscribed circle; default: the hull (Nav2: the circle)."""
    near_goal_distance: NonNegativeLength = 1.0
    """So near to the plan's end only critical costs count."""
    trajectory_point_step: Every = 2
    """Every which pose is looked at."""


class MppiObstaclesCritic(MppiCritic):
    """Against obstacles, by distances; takes the place of CostCritic."""

    repulsion_weight: Weight = 1.5
    """Of nearness within the inflation radius."""
    critical_weight: Weight = 20.0
    """Of nearness within `collision_margin_distance`."""
    collision_cost: Weight = 100_000.0
    """Cost of a trajectory that hits something."""
    collision_margin_distance: NonNegativeLength = 0.10
    """Nearer than this is all but a collision."""
    consider_footprint: bool | None = None
    """Whether the whole hull must be free, or its inscribed circle; default: the hull (Nav2: the circle)."""
    near_goal_distance: NonNegativeLength = 0.5
    """So near to the plan's end only critical nearness counts."""


class MppiGoalCritic(MppiCritic):
    """Towards the plan's end, once that is near."""

    cost_weight: Weight = 5.0
    """Of the mean distance in meters."""
    threshold_to_consider: NonNegativeLength = 1.4
    """How near."""


class MppiGoalAngleCritic(MppiCritic):
    """Towards the goal's heading, once that is near."""

    cost_weight: Weight = 3.0
    """Of the mean angle in rad."""
    threshold_to_consider: NonNegativeLength = 0.5
    """How near."""
    symmetric_yaw_tolerance: bool = False
    """Whether the opposite heading is as good."""


class MppiPathAlignCritic(MppiCritic):
    """Along the plan: where a trajectory is after so many meters, against where the plan is."""

    cost_weight: Weight = 14.0
    """Of the mean distance in meters."""
    max_path_occupancy_ratio: Annotated[float, Field(ge=0, le=1), Quantity("ratio")] = 0.05
    """Is silent where more of the plan than this is blocked."""
    trajectory_point_step: Every = 4
    """Every which pose is looked at."""
    threshold_to_consider: NonNegativeLength = 0.5
    """Is silent nearer to the plan's end than this."""
    offset_from_furthest: Points = 20
    """Is silent until a trajectory gets to so many points of the plan, 5 cm apart: a robot must turn first."""
    use_path_orientations: bool = False
    """Whether headings count, too."""


class MppiPathFollowCritic(MppiCritic):
    """Onward: the end of a trajectory, against a point of the plan beyond the furthest that any reaches."""

    cost_weight: Weight = 5.0
    """Of the distance in meters."""
    offset_from_furthest: Points = 5
    """How many points of the plan beyond, 5 cm apart; points that are blocked are passed over."""
    threshold_to_consider: NonNegativeLength = 1.4
    """Is silent nearer to the plan's end than this."""


class MppiPathAngleCritic(MppiCritic):
    """Looking onward: the heading at the end of a trajectory, where the robot looks another way than the plan leads."""

    cost_weight: Weight = 2.0
    """Of the angle in rad."""
    offset_from_furthest: Points = 4
    """To a point of the plan so many points beyond the furthest that any trajectory reaches."""
    threshold_to_consider: NonNegativeLength = 0.5
    """Is silent nearer to the plan's end than this."""
    max_angle_to_furthest: NonNegativeAngle = 1.0
    """Is silent where the robot looks there but for this angle."""
    mode: Annotated[int, Field(ge=0, le=2)] = 0
    """0: forward is preferred; 1: forward and backward are alike; 2: as the poses of the plan look."""


class MppiPreferForwardCritic(MppiCritic):
    """Against driving backward."""

    cost_weight: Weight = 5.0
    """Of the meters driven backward."""
    threshold_to_consider: NonNegativeLength = 0.5
    """Is silent nearer to the plan's end than this."""


class MppiTwirlingCritic(MppiCritic):
    """Against turning: keeps an omnidirectional base from spinning as it goes."""

    cost_weight: Weight = 10.0
    """Of the mean turn rate in rad/s."""


class MppiVelocityDeadbandCritic(MppiCritic):
    """Against velocities that are too low to move a base with friction."""

    cost_weight: Weight = 35.0
    """Of m/s and rad/s too few, over the seconds."""
    deadband_velocities: Annotated[
        tuple[NonNegativeSpeed, NonNegativeSpeed, NonNegativeAngularSpeed], Field(strict=False)
    ] = (0.0, 0.0, 0.0)
    """Ahead, sideways and turning: below these the base does not move."""


class MppiTrajectoryValidator(Spec):
    """The last look at the trajectory that comes out (mppi::DefaultOptimalTrajectoryValidator)."""

    collision_lookahead_time: Duration = 2.0
    """For how long it must be free."""
    consider_footprint: bool | None = None
    """Whether the whole hull must be free, or its inscribed circle; default: the hull (Nav2: the circle)."""


class Mppi(ControllerSpec):
    """Model predictive path integral control (Williams et al. 2017; nav2_mppi_controller)."""

    component: ClassVar[str] = "simscen.stack.controllers.mppi.controller:MppiController"
    type: Literal["mppi"]
    motion_model: Literal["DiffDrive", "Omni", "Ackermann"] | None = None
    """Default: as the robot's drive."""
    min_turning_r: PositiveLength | None = None
    """Of the Ackermann model; default: the robot's own turning radius (Nav2: 0.2 m)."""
    time_steps: Annotated[int, Field(ge=5, le=200)] = 56
    """Steps that each sample looks ahead."""
    model_dt: Annotated[PositiveDuration, Field(le=1)] = 0.05
    """How long a step is."""
    batch_size: Annotated[int, Field(ge=50, le=10_000)] = 1000
    """Samples for each command."""
    iteration_count: Annotated[int, Field(ge=1, le=20)] = 1
    """How often a command is improved."""
    vx_max: PositiveSpeed | None = None
    """Greatest speed forward; default: 0.5 m/s, or what the robot can do if that is less."""
    vx_min: Annotated[Speed, Field(ge=-10, le=0)] = -0.35
    """Greatest speed backward, negative."""
    vy_max: NonNegativeSpeed | None = None
    """Greatest speed sideways of the Omni model; default: 0.5 m/s, or what the robot can do if that is less."""
    wz_max: PositiveAngularSpeed = 1.9
    """Greatest turn rate."""
    ax_max: PositiveAcceleration | None = None
    """Default: the robot's own limit; so are those below."""
    ax_min: Deceleration | None = None
    """Braking, negative."""
    ay_max: PositiveAcceleration | None = None
    """Sideways."""
    ay_min: Deceleration | None = None
    """Braking sideways, negative."""
    az_max: PositiveAngularAcceleration | None = None
    """Of the turn rate."""
    model_delay_vx: Annotated[Duration, Field(le=2)] = 0.0
    """How late the base answers, from the command on: what was sent and is under way is part of every sample."""
    model_delay_vy: Annotated[Duration, Field(le=2)] = 0.0
    """Sideways."""
    model_delay_wz: Annotated[Duration, Field(le=2)] = 0.0
    """Of its turn rate."""
    vx_std: PositiveSpeed | None = None
    """Standard deviation of the sampled speeds; default: half of `vx_max` (Nav2: 0.2 m/s)."""
    vy_std: PositiveSpeed | None = None
    """Standard deviation of the sampled speeds sideways; default: half of `vy_max`."""
    wz_std: PositiveAngularSpeed = 0.4
    """Standard deviation of the sampled turn rates."""
    temperature: Annotated[float, Field(gt=0, le=100)] = 0.3
    """How evenly samples are weighted: the lower, the more the best one counts."""
    gamma: Annotated[float, Field(ge=0, le=10)] = 0.015
    """Weight of the energy of a command, against the costs of a sample."""
    regenerate_noises: bool = False
    """Whether samples are drawn anew for each command."""
    retry_attempt_limit: Annotated[int, Field(ge=0, le=20)] = 1
    """How often it begins anew within a command, when all it has found hits something."""
    open_loop: bool = False
    """Whether it takes its last command for the velocity that the robot has."""
    sgf_order: Annotated[int, Field(ge=1, le=2)] = 2
    """Of the Savitzky-Golay filter that smooths commands: 2 keeps their bends, 1 is a mean of nine."""
    critics: Annotated[list[CriticName], Field(min_length=1, max_length=11)] | None = None
    """Which are asked; default: as in Nav2 all but ObstaclesCritic and VelocityDeadbandCritic, and TwirlingCritic
    only with the Omni model."""
    ConstraintCritic: MppiConstraintCritic = by_default()
    """Keeps to the limits."""
    CostCritic: MppiCostCritic = by_default()
    """Keeps off obstacles."""
    ObstaclesCritic: MppiObstaclesCritic = by_default()
    """Keeps off obstacles by distance, where it is among `critics`."""
    GoalCritic: MppiGoalCritic = by_default()
    """Gets to the goal."""
    GoalAngleCritic: MppiGoalAngleCritic = by_default()
    """Gets to its heading."""
    PathAlignCritic: MppiPathAlignCritic = by_default()
    """Keeps to the plan."""
    PathFollowCritic: MppiPathFollowCritic = by_default()
    """Gets on."""
    PathAngleCritic: MppiPathAngleCritic = by_default()
    """Looks where the plan leads."""
    PreferForwardCritic: MppiPreferForwardCritic = by_default()
    """Prefers driving forward."""
    TwirlingCritic: MppiTwirlingCritic = by_default()
    """Does not spin, where it is among `critics`."""
    VelocityDeadbandCritic: MppiVelocityDeadbandCritic = by_default()
    """Does not creep, where it is among `critics`."""
    TrajectoryValidator: MppiTrajectoryValidator = by_default()
    """Has the last word."""

    @property
    def looks_ahead(self) -> float:
        """As far as its samples."""
        return self.time_steps * self.model_dt
