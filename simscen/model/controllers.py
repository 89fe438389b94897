"""Specifications of controllers, goal checkers, and the progress checker.

The names and default values are the same as in Nav2, unless noted.
"""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from simscen.model.stack_base import ControllerSpec, Deceleration, GoalTolerances, PathFollowerSpec, Weight
from simscen.spec.base import Ranged, Spec, Typed
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.quantities import (
    Angle,
    Length,
    NonNegativeAngularSpeed,
    NonNegativeLength,
    NonNegativeSpeed,
    PositiveAcceleration,
    PositiveAngle,
    PositiveAngularAcceleration,
    PositiveAngularSpeed,
    PositiveDuration,
    PositiveLength,
    PositiveSpeed,
    Quantity,
    Speed,
)

SidewaysAcceleration = Annotated[float, Field(ge=0, le=1000), Quantity("acceleration")]
SidewaysDeceleration = Annotated[float, Field(ge=-1000, le=0), Quantity("acceleration")]
AngularDeceleration = Annotated[float, Field(ge=-1000, lt=0), Quantity("angular acceleration")]


class RegulatedPurePursuit(Ranged, PathFollowerSpec):
    """Regulated pure pursuit controller (Macenski et al. 2023; nav2_regulated_pure_pursuit_controller)."""

    component: ClassVar[str] = "simscen.stack.controllers.regulated_pure_pursuit:RegulatedPurePursuit"
    type: Literal["regulated_pure_pursuit"] = "regulated_pure_pursuit"
    desired_linear_vel: PositiveSpeed | None = None
    """Maximum speed; default: 0.5 m/s, or the limit of the robot if that is lower."""
    lookahead_dist: PositiveLength = 0.6
    """Lookahead distance: the distance to the point on the plan (the carrot) that the robot steers to."""
    min_lookahead_dist: PositiveLength = 0.3
    """Minimum lookahead distance if the lookahead distance scales with speed."""
    max_lookahead_dist: PositiveLength = 0.9
    """Maximum lookahead distance if the lookahead distance scales with speed."""
    lookahead_time: PositiveDuration = 1.5
    """Lookahead distance divided by the current speed, if the lookahead distance scales with speed."""
    use_velocity_scaled_lookahead_dist: bool = True
    """Whether the lookahead distance scales with speed."""
    use_fixed_curvature_lookahead: bool = False
    """Whether to compute the curvature from a separate point, `curvature_lookahead_dist` ahead."""
    curvature_lookahead_dist: PositiveLength = 0.6
    """Distance to the point that defines the curvature."""
    interpolate_curvature_after_goal: bool = False
    """Whether the point for the curvature may lie beyond the end of the plan."""
    rotate_to_heading_angular_vel: PositiveAngularSpeed = 1.8
    """Turn rate when turning in place."""
    rotate_to_heading_min_angle: PositiveAngle = 0.785
    """Angle to the plan beyond which the robot turns in place."""
    use_rotate_to_heading: bool = True
    """Whether to turn in place towards the plan, and at the goal to its heading."""
    min_approach_linear_velocity: PositiveSpeed = 0.05
    """Minimum speed when approaching the goal."""
    approach_velocity_scaling_dist: PositiveLength = 0.6
    """Distance from the end of the plan at which the robot begins to slow down."""
    use_collision_detection: bool = True
    """Whether to stop if the command would lead to a collision."""
    max_allowed_time_to_collision_up_to_carrot: PositiveDuration = 1.0
    """Time for which commands are checked for collisions, at most up to the carrot."""
    min_slowed_speed: PositiveSpeed = 0.1
    """Minimum speed to which the controller slows down a command that would lead to a collision. If the robot would
    collide at this speed as well, the controller fails with NO_VALID_CONTROL. Nav2 fails at once."""
    use_regulated_linear_velocity_scaling: bool = True
    """Whether to slow down in tight curves."""
    regulated_linear_scaling_min_radius: PositiveLength = 0.9
    """Radius below which curves are driven more slowly."""
    regulated_linear_scaling_min_speed: PositiveSpeed = 0.25
    """Minimum speed in curves and near obstacles."""
    use_cost_regulated_linear_velocity_scaling: bool = True
    """Whether to slow down near obstacles."""
    cost_scaling_dist: PositiveLength = 0.6
    """Distance from an obstacle below which the robot slows down."""
    cost_scaling_gain: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 1.0
    """Factor of the reduced speed: speed · this value · distance / `cost_scaling_dist`."""
    slow_down_ahead: bool = True
    """Whether to slow down before curves, obstacles, and narrow gaps. Nav2 considers only the current position."""
    max_angular_accel: PositiveAngularAcceleration = 3.2
    """Maximum angular acceleration when turning in place."""
    allow_reversing: bool = False
    """Whether to drive backward to a point behind the robot."""

    @model_validator(mode="after")
    def _check_interpolation(self) -> "RegulatedPurePursuit":
        """Raise ValueError for an interpolated curvature without a separate point for the curvature."""
        if self.interpolate_curvature_after_goal and not self.use_fixed_curvature_lookahead:
            raise ValueError("`interpolate_curvature_after_goal` needs `use_fixed_curvature_lookahead: true`")
        return self

    @property
    def lookahead_s(self) -> float:
        """Time in seconds for which commands are checked for collisions."""
        return self.max_allowed_time_to_collision_up_to_carrot


class DynamicWindow(PathFollowerSpec):
    """Dynamic-window controller with DWB's critics (Fox et al. 1997; nav2_dwb_controller)."""

    component: ClassVar[str] = "simscen.stack.controllers.dwb.controller:DynamicWindowController"
    type: Literal["dwb"]
    max_vel_x: PositiveSpeed | None = None
    """Maximum forward speed; default: 0.5 m/s, or the limit of the robot if that is lower."""
    min_vel_x: Annotated[Speed, Field(ge=-10, le=0)] = 0.0
    """Maximum backward speed, negative."""
    max_vel_y: NonNegativeSpeed | None = None
    """Maximum speed to the left; default: `max_vel_x` if the base can move sideways, otherwise 0."""
    min_vel_y: Annotated[Speed, Field(ge=-100, le=0)] | None = None
    """Maximum speed to the right, negative; default: the same as to the left."""
    max_vel_theta: PositiveAngularSpeed = 1.0
    """Maximum turn rate."""
    min_speed_xy: NonNegativeSpeed = 0.0
    """Minimum speed of trajectories that turn slower than `min_speed_theta`."""
    max_speed_xy: PositiveSpeed | None = None
    """Maximum speed in any direction; default: `max_vel_x`."""
    min_speed_theta: NonNegativeAngularSpeed = 0.0
    """Minimum turn rate of trajectories that move slower than `min_speed_xy`."""
    acc_lim_x: PositiveAcceleration | None = None
    """Maximum forward acceleration; default: the limit of the robot."""
    acc_lim_y: SidewaysAcceleration | None = None
    """Maximum sideways acceleration; 0 if the base cannot move sideways. Default: the limit of the robot."""
    acc_lim_theta: PositiveAngularAcceleration | None = None
    """Maximum angular acceleration; default: the limit of the robot."""
    decel_lim_x: Deceleration | None = None
    """Maximum deceleration, negative; default: the limit of the robot."""
    decel_lim_y: SidewaysDeceleration | None = None
    """Maximum deceleration of sideways motion, negative; 0 if the base cannot move sideways. Default: the limit of the
    robot."""
    decel_lim_theta: AngularDeceleration | None = None
    """Maximum angular deceleration, negative; default: the limit of the robot."""
    vx_samples: Annotated[int, Field(ge=0, le=200)] = 20
    """Number of forward speeds to try; at least two, as in Nav2."""
    vy_samples: Annotated[int, Field(ge=0, le=200)] = 5
    """Number of sideways speeds to try if the base can move sideways; at least two, as in Nav2."""
    vtheta_samples: Annotated[int, Field(ge=0, le=200)] = 20
    """Number of turn rates to try; at least two, as in Nav2."""
    sim_time: PositiveDuration = 1.7
    """Duration of each simulated trajectory."""
    linear_granularity: Annotated[Length, Field(ge=0.01, le=10)] = 0.05
    """Maximum distance between two poses of a trajectory."""
    angular_granularity: Annotated[Angle, Field(ge=0.005, le=10)] = 0.025
    """Maximum angle between two poses of a trajectory."""
    trans_stopped_velocity: NonNegativeSpeed = 0.25
    """Speed at the goal below which the robot begins to turn to the goal's heading."""
    prune_distance: PositiveLength = 1.5
    """Minimum length of the plan ahead that is considered (Nav2: 2 m)."""
    base_obstacle_scale: Weight = 0.02
    """Weight of the costs at the end of a trajectory."""
    path_align_scale: Weight = 32.0
    """Weight of the distance between the front of the robot and the plan, at the end of a trajectory."""
    path_dist_scale: Weight = 32.0
    """Weight of the distance between the robot and the plan, at the end of a trajectory."""
    goal_align_scale: Weight = 24.0
    """Weight of the distance between the front of the robot, at the end of a trajectory, and the end of the plan."""
    goal_dist_scale: Weight = 24.0
    """Weight of the distance between the end of a trajectory and the end of the plan."""
    rotate_to_goal_scale: Weight = 32.0
    """Weight of the heading error at the goal; 0: the robot does not stop at the goal to turn."""
    slowing_factor: Weight = 5.0
    """Weight of the speed while the robot stops at the goal before it turns."""
    twirling_scale: Weight = 0.0
    """Weight of the turn rate. It keeps an omnidirectional base from spinning while it drives."""
    preferred_clearance: NonNegativeLength = 0.05
    """Minimum clearance of the footprint, ignored if no trajectory has this clearance. Nav2 has no such parameter."""
    forward_point_distance: NonNegativeLength = 0.1
    """Distance from the center of the robot to its front, for the two alignment weights."""
    oscillation_reset_dist: NonNegativeLength = 0.05
    """Distance after which an oscillating motion may change its direction again."""
    oscillation_reset_angle: Annotated[Angle, Field(ge=0)] = 0.2
    """Angle after which an oscillating motion may change its direction again."""
    x_only_threshold: NonNegativeSpeed = 0.05
    """Forward speed below which turns in alternating directions count as oscillation as well."""

    @property
    def lookahead_s(self) -> float:
        """Duration of a trajectory in seconds."""
        return self.sim_time


CONTROLLERS = {
    "regulated_pure_pursuit": "simscen.model.controllers:RegulatedPurePursuit",
    "dwb": "simscen.model.controllers:DynamicWindow",
    "mppi": "simscen.model.mppi:Mppi",
}
"""Specifications of the shipped controllers as `module:Class`, by type."""
Controller = Annotated[ControllerSpec, ExtensibleUnion("controller", default="regulated_pure_pursuit")]


class GoalCheckerSpec(GoalTolerances, Typed):
    """Base class of goal checker specifications."""


class SimpleGoalChecker(GoalCheckerSpec):
    """Goal checker that compares position and heading with tolerances (nav2_controller::SimpleGoalChecker)."""

    component: ClassVar[str] = "simscen.stack.checkers:SimpleGoalChecker"
    type: Literal["simple"] = "simple"
    stateful: bool = True
    """Whether the position check is relaxed after its first success: from then on, the full `xy_goal_tolerance` applies
    instead of its fraction `well_inside`. No effect if `well_inside` is 1. Nav2 does not check the position again."""
    well_inside: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 1.0
    """Fraction of the tolerances that applies while the robot moves. At rest, the full tolerances apply. Nav2: 1."""


GOAL_CHECKERS = {"simple": "simscen.model.controllers:SimpleGoalChecker"}
"""Specifications of the shipped goal checkers as `module:Class`, by type."""
GoalChecker = Annotated[GoalCheckerSpec, ExtensibleUnion("goal_checker", default="simple")]


class ProgressChecker(Spec):
    """Detects that the robot makes no progress (nav2_controller::SimpleProgressChecker or PoseProgressChecker)."""

    required_movement_radius: PositiveLength = 0.5
    """Distance that the robot must move within the time allowance."""
    required_movement_angle: PositiveAngle | None = None
    """Angle of a turn that counts as progress as well (PoseProgressChecker); default: turns are no progress."""
    movement_time_allowance: PositiveDuration = 10.0
    """Time without progress after which driving fails with FAILED_TO_MAKE_PROGRESS."""
