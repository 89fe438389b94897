"""Specification of the MPPI controller and its critics, with the parameters of nav2_mppi_controller."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from simscen.model.stack_base import Deceleration, PathFollowerSpec, Weight
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

Exponent = Annotated[int, Field(ge=1, le=10)]
PointCount = Annotated[int, Field(ge=0, le=1000)]
PoseStep = Annotated[int, Field(ge=1, le=100)]
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
    """Base class of critics: cost = (weight · measured value) to the power of `cost_power`."""

    enabled: bool = True
    """Whether to use the critic."""
    cost_power: Exponent = 1
    """Exponent of the cost."""


class MppiConstraintCritic(MppiCritic):
    """Penalizes velocities beyond the limits of the base."""

    cost_weight: Weight = 4.0
    """Weight of the excess speed in m/s, integrated over time."""


class MppiCostCritic(MppiCritic):
    """Penalizes proximity to obstacles by the costs of the costmap."""

    cost_weight: Weight = 3.81
    """Weight of the mean cost; a cost of 254 counts as 1."""
    critical_cost: Weight = 300.0
    """Cost of a pose whose cell cost is at least `near_collision_cost`."""
    near_collision_cost: Annotated[int, Field(ge=1, le=255)] = 253
    """Cell cost from which a pose is critical."""
    collision_cost: Weight = 1_000_000.0
    """Cost of a trajectory that collides."""
    consider_footprint: bool | None = None
    """Whether to check the whole footprint instead of its inscribed circle; default: true (Nav2: false)."""
    near_goal_distance: NonNegativeLength = 1.0
    """Distance from the end of the plan within which only critical costs count."""
    trajectory_point_step: PoseStep = 2
    """Step between the poses of a trajectory that are checked."""


class MppiObstaclesCritic(MppiCritic):
    """Penalizes proximity to obstacles by distance; alternative to CostCritic."""

    repulsion_weight: Weight = 1.5
    """Weight of proximity within the inflation radius."""
    critical_weight: Weight = 20.0
    """Weight of proximity within `collision_margin_distance`."""
    collision_cost: Weight = 100_000.0
    """Cost of a trajectory that collides."""
    collision_margin_distance: NonNegativeLength = 0.10
    """Distance from an obstacle within which a pose is critical."""
    consider_footprint: bool | None = None
    """Whether to check the whole footprint instead of its inscribed circle; default: true (Nav2: false)."""
    near_goal_distance: NonNegativeLength = 0.5
    """Distance from the end of the plan within which only critical proximity counts."""


class MppiGoalCritic(MppiCritic):
    """Penalizes the distance from the goal, near the goal."""

    cost_weight: Weight = 5.0
    """Weight of the mean distance in meters."""
    threshold_to_consider: NonNegativeLength = 1.4
    """Distance from the goal within which the critic is active."""


class MppiGoalAngleCritic(MppiCritic):
    """Penalizes the difference from the goal's heading, near the goal."""

    cost_weight: Weight = 3.0
    """Weight of the mean angle in rad."""
    threshold_to_consider: NonNegativeLength = 0.5
    """Distance from the goal within which the critic is active."""
    symmetric_yaw_tolerance: bool = False
    """Whether the opposite heading is equally good."""


class MppiPathAlignCritic(MppiCritic):
    """Penalizes the distance between a trajectory and the plan, compared at the same driven distance."""

    cost_weight: Weight = 14.0
    """Weight of the mean distance in meters."""
    max_path_occupancy_ratio: Annotated[float, Field(ge=0, le=1), Quantity("ratio")] = 0.05
    """Maximum fraction of the plan that is blocked. The critic is inactive above this fraction."""
    trajectory_point_step: PoseStep = 4
    """Step between the poses of a trajectory that are checked."""
    threshold_to_consider: NonNegativeLength = 0.5
    """Distance from the end of the plan within which the critic is inactive."""
    offset_from_furthest: PointCount = 20
    """Number of plan points, 5 cm apart, that a trajectory must reach for the critic to be active."""
    use_path_orientations: bool = False
    """Whether to penalize differences from the headings of the plan as well."""


class MppiPathFollowCritic(MppiCritic):
    """Penalizes the distance of the end of a trajectory from the target point on the plan.

    The target point is beyond the furthest plan point that any trajectory reaches.
    """

    cost_weight: Weight = 5.0
    """Weight of the distance in meters."""
    offset_from_furthest: PointCount = 5
    """Number of plan points, 5 cm apart, between the target point and the furthest plan point that any trajectory
    reaches. Blocked points are skipped."""
    threshold_to_consider: NonNegativeLength = 1.4
    """Distance from the end of the plan within which the critic is inactive."""


class MppiPathAngleCritic(MppiCritic):
    """Penalizes the angle between the heading at the end of a trajectory and the direction to a target point on the
    plan."""

    cost_weight: Weight = 2.0
    """Weight of the angle in rad."""
    offset_from_furthest: PointCount = 4
    """Number of plan points, 5 cm apart, between the target point and the furthest plan point that any trajectory
    reaches."""
    threshold_to_consider: NonNegativeLength = 0.5
    """Distance from the end of the plan within which the critic is inactive."""
    max_angle_to_furthest: NonNegativeAngle = 1.0
    """Angle between the robot's heading and the direction to the target point below which the critic is inactive."""
    mode: Annotated[int, Field(ge=0, le=2)] = 0
    """0: forward driving is preferred; 1: forward and backward driving are equal; 2: the orientations of the plan
    decide."""


class MppiPreferForwardCritic(MppiCritic):
    """Penalizes backward driving."""

    cost_weight: Weight = 5.0
    """Weight of the distance in meters driven backward."""
    threshold_to_consider: NonNegativeLength = 0.5
    """Distance from the end of the plan within which the critic is inactive."""


class MppiTwirlingCritic(MppiCritic):
    """Penalizes turning, so that an omnidirectional base does not spin while it drives."""

    cost_weight: Weight = 10.0
    """Weight of the mean turn rate in rad/s."""


class MppiVelocityDeadbandCritic(MppiCritic):
    """Penalizes velocities that are too low to move a base with friction."""

    cost_weight: Weight = 35.0
    """Weight of the difference between a velocity and its deadband (m/s, rad/s), integrated over time."""
    deadband_velocities: Annotated[
        tuple[NonNegativeSpeed, NonNegativeSpeed, NonNegativeAngularSpeed], Field(strict=False)
    ] = (0.0, 0.0, 0.0)
    """Velocities forward, sideways, and turning below which the base does not move."""


class MppiTrajectoryValidator(Spec):
    """Final check of the selected trajectory (mppi::DefaultOptimalTrajectoryValidator)."""

    collision_lookahead_time: Duration = 2.0
    """Time for which the trajectory must be free of collisions."""
    consider_footprint: bool | None = None
    """Whether to check the whole footprint instead of its inscribed circle; default: true (Nav2: false)."""


class Mppi(PathFollowerSpec):
    """Model predictive path integral controller (Williams et al. 2017; nav2_mppi_controller)."""

    component: ClassVar[str] = "simscen.stack.controllers.mppi.controller:MppiController"
    type: Literal["mppi"]
    motion_model: Literal["DiffDrive", "Omni", "Ackermann"] | None = None
    """Motion model; default: the model of the robot's drive."""
    min_turning_r: PositiveLength | None = None
    """Minimum turning radius with any motion model; default: the minimum of the robot. Nav2 uses it only with the
    Ackermann model (default: 0.2 m)."""
    time_steps: Annotated[int, Field(ge=5, le=200)] = 56
    """Number of time steps per sample."""
    model_dt: Annotated[PositiveDuration, Field(le=1)] = 0.05
    """Duration of a time step."""
    batch_size: Annotated[int, Field(ge=50, le=10_000)] = 1000
    """Number of samples per command."""
    iteration_count: Annotated[int, Field(ge=1, le=20)] = 1
    """Number of optimization iterations per command."""
    vx_max: PositiveSpeed | None = None
    """Maximum forward speed; default: 0.5 m/s, or the limit of the robot if that is lower."""
    vx_min: Annotated[Speed, Field(ge=-10, le=0)] = -0.35
    """Maximum backward speed, negative."""
    vy_max: NonNegativeSpeed | None = None
    """Maximum sideways speed of the Omni model; default: 0.5 m/s, or the limit of the robot if that is lower."""
    wz_max: PositiveAngularSpeed = 1.9
    """Maximum turn rate."""
    ax_max: PositiveAcceleration | None = None
    """Maximum forward acceleration; default: the limit of the robot."""
    ax_min: Deceleration | None = None
    """Maximum deceleration, negative; default: the limit of the robot."""
    ay_max: PositiveAcceleration | None = None
    """Maximum sideways acceleration; default: the limit of the robot."""
    ay_min: Deceleration | None = None
    """Maximum sideways deceleration, negative; default: the limit of the robot."""
    az_max: PositiveAngularAcceleration | None = None
    """Maximum angular acceleration; default: the limit of the robot."""
    model_delay_vx: Annotated[Duration, Field(le=2)] = 0.0
    """Delay between a forward command and its execution by the base. Each sample starts with the commands that the base
    has not executed yet."""
    model_delay_vy: Annotated[Duration, Field(le=2)] = 0.0
    """Delay between a sideways command and its execution by the base."""
    model_delay_wz: Annotated[Duration, Field(le=2)] = 0.0
    """Delay between a turn command and its execution by the base."""
    vx_std: PositiveSpeed | None = None
    """Standard deviation of the sampled forward speeds; default: half of `vx_max` (Nav2: 0.2 m/s)."""
    vy_std: PositiveSpeed | None = None
    """Standard deviation of the sampled sideways speeds; default: half of `vy_max`."""
    wz_std: PositiveAngularSpeed = 0.4
    """Standard deviation of the sampled turn rates."""
    temperature: Annotated[float, Field(gt=0, le=100)] = 0.3
    """Temperature of the weighting: lower values prefer the best samples more strongly."""
    gamma: Annotated[float, Field(ge=0, le=10)] = 0.015
    """Weight of the control effort relative to the cost of a sample."""
    prune_distance: PositiveLength = 2.0
    """Minimum length of the plan ahead that is considered (Nav2's default: 1.5 m)."""
    command_free_time: Annotated[PositiveDuration, Field(le=60)] = 0.5
    """Time for which a constant command must be free of collisions; otherwise the command is slowed down. Nav2 has no
    such check."""
    min_slowed_speed: PositiveSpeed = 0.1
    """Minimum speed to which the controller slows down a command that would lead to a collision. If the robot would
    collide at this speed as well, the controller fails with NO_VALID_CONTROL."""
    regenerate_noises: bool = False
    """Whether to draw new samples for each command."""
    retry_attempt_limit: Annotated[int, Field(ge=0, le=20)] = 1
    """Number of restarts per command if all sampled trajectories collide, or if the optimized trajectory collides."""
    open_loop: bool = False
    """Whether to use the last command instead of the measured velocity."""
    sgf_order: Annotated[int, Field(ge=1, le=2)] = 2
    """Order of the Savitzky-Golay filter that smooths commands: 2 keeps bends, 1 is the mean of nine commands."""
    critics: Annotated[list[CriticName], Field(min_length=1, max_length=11)] | None = None
    """Critics to use; default: all except ObstaclesCritic and VelocityDeadbandCritic, and TwirlingCritic only with the
    Omni model."""
    ConstraintCritic: MppiConstraintCritic = by_default()
    """Parameters of the critic of velocity limits."""
    CostCritic: MppiCostCritic = by_default()
    """Parameters of the critic of obstacle costs."""
    ObstaclesCritic: MppiObstaclesCritic = by_default()
    """Parameters of the critic of obstacle distances; used only if listed in `critics`."""
    GoalCritic: MppiGoalCritic = by_default()
    """Parameters of the critic of the goal distance."""
    GoalAngleCritic: MppiGoalAngleCritic = by_default()
    """Parameters of the critic of the goal heading."""
    PathAlignCritic: MppiPathAlignCritic = by_default()
    """Parameters of the critic of alignment with the plan."""
    PathFollowCritic: MppiPathFollowCritic = by_default()
    """Parameters of the critic of progress along the plan."""
    PathAngleCritic: MppiPathAngleCritic = by_default()
    """Parameters of the critic of the direction of the plan."""
    PreferForwardCritic: MppiPreferForwardCritic = by_default()
    """Parameters of the critic of backward driving."""
    TwirlingCritic: MppiTwirlingCritic = by_default()
    """Parameters of the critic of turning; used if listed in `critics`, or by default with the Omni model."""
    VelocityDeadbandCritic: MppiVelocityDeadbandCritic = by_default()
    """Parameters of the critic of velocities below the deadband; used only if listed in `critics`."""
    TrajectoryValidator: MppiTrajectoryValidator = by_default()
    """Parameters of the final check of the trajectory."""

    @property
    def lookahead_s(self) -> float:
        """Duration of a sampled trajectory in seconds."""
        return self.time_steps * self.model_dt
