"""The parameters of the controllers, with Nav2's names, meanings and defaults; what differs says so."""

from typing import Annotated, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from simscen.model.mppi import Mppi
from simscen.model.stack_base import ControllerSpec, Weight
from simscen.spec.base import Ranged, type_discriminator
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

Deceleration = Annotated[float, Field(ge=-1000, lt=0), Quantity("acceleration")]
SidewaysAcceleration = Annotated[float, Field(ge=0, le=1000), Quantity("acceleration")]
SidewaysDeceleration = Annotated[float, Field(ge=-1000, le=0), Quantity("acceleration")]
AngularDeceleration = Annotated[float, Field(ge=-1000, lt=0), Quantity("angular acceleration")]


class RegulatedPurePursuit(Ranged, ControllerSpec):
    """nav2_regulated_pure_pursuit_controller (Macenski et al. 2023)."""

    component: ClassVar[str] = "simscen.stack.controllers.regulated_pure_pursuit:RegulatedPurePursuit"
    type: Literal["regulated_pure_pursuit"] = "regulated_pure_pursuit"
    desired_linear_vel: PositiveSpeed | None = None
    """Default: 0.5 m/s, or what the robot can do if that is less."""
    lookahead_dist: PositiveLength = 0.6
    """To the point of the plan that is followed, where its distance is not scaled by speed."""
    min_lookahead_dist: PositiveLength = 0.3
    """The least, where it is scaled by speed."""
    max_lookahead_dist: PositiveLength = 0.9
    """The greatest, where it is scaled by speed."""
    lookahead_time: PositiveDuration = 1.5
    """The lookahead distance is the way driven in this time."""
    use_velocity_scaled_lookahead_dist: bool = True
    """Whether the lookahead distance is scaled by speed."""
    use_fixed_curvature_lookahead: bool = False
    """Whether the curvature is taken from a point of its own, `curvature_lookahead_dist` ahead."""
    curvature_lookahead_dist: PositiveLength = 0.6
    """How far ahead that point is."""
    interpolate_curvature_after_goal: bool = False
    """Whether that point may lie beyond the plan's end, so that the robot comes in straight."""
    rotate_to_heading_angular_vel: PositiveAngularSpeed = 1.8
    """Turn rate when it turns in place."""
    rotate_to_heading_min_angle: PositiveAngle = 0.785
    """It turns in place when the plan leads off by more than this."""
    use_rotate_to_heading: bool = True
    """Whether it turns in place at all: towards the plan, and at the goal to its heading."""
    min_approach_linear_velocity: PositiveSpeed = 0.05
    """The least speed on the last stretch to the goal."""
    approach_velocity_scaling_dist: PositiveLength = 0.6
    """How far from the plan's end it begins to slow down."""
    use_collision_detection: bool = True
    """Whether it stops when what it commands would lead into an obstacle."""
    max_allowed_time_to_collision_up_to_carrot: PositiveDuration = 1.0
    """How far ahead it looks for collisions, no further than the point that it follows."""
    use_regulated_linear_velocity_scaling: bool = True
    """Whether it slows down in narrow curves."""
    regulated_linear_scaling_min_radius: PositiveLength = 0.9
    """Narrower curves are driven slower."""
    regulated_linear_scaling_min_speed: PositiveSpeed = 0.25
    """The least speed that curves and costs slow it down to."""
    use_cost_regulated_linear_velocity_scaling: bool = True
    """Whether it slows down near obstacles."""
    cost_scaling_dist: PositiveLength = 0.6
    """How near an obstacle must be to slow it down."""
    cost_scaling_gain: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 1.0
    """How much: speed times this share of the distance over `cost_scaling_dist`."""
    slow_down_ahead: bool = True
    """Whether it slows down before bends and obstacles, so that its brakes suffice, and in gaps by the room beside its
    hull. Nav2 does neither: it looks at where the robot is."""
    max_angular_accel: PositiveAngularAcceleration = 3.2
    """Of its turn rate, when it turns in place."""
    allow_reversing: bool = False
    """Whether it drives backward to a carrot behind it."""

    @model_validator(mode="after")
    def _has_a_point_to_interpolate(self) -> "RegulatedPurePursuit":
        if self.interpolate_curvature_after_goal and not self.use_fixed_curvature_lookahead:
            raise ValueError("`interpolate_curvature_after_goal` is for `use_fixed_curvature_lookahead: true`")
        return self

    @property
    def looks_ahead(self) -> float:
        """The time to collision that it keeps."""
        return self.max_allowed_time_to_collision_up_to_carrot


class DynamicWindow(ControllerSpec):
    """A dynamic-window controller with DWB's critics (Fox et al. 1997; nav2_dwb_controller)."""

    component: ClassVar[str] = "simscen.stack.controllers.dwb.controller:DynamicWindowController"
    type: Literal["dwb"]
    max_vel_x: PositiveSpeed | None = None
    """Greatest speed forward; default: 0.5 m/s, or what the robot can do if that is less."""
    min_vel_x: Annotated[Speed, Field(ge=-10, le=0)] = 0.0
    """Greatest speed backward, negative."""
    max_vel_y: NonNegativeSpeed | None = None
    """Greatest speed sideways, to the left; default: as `max_vel_x`, where the base can do it, else 0."""
    min_vel_y: Annotated[Speed, Field(ge=-100, le=0)] | None = None
    """Greatest speed sideways, to the right, negative; default: as far to the left."""
    max_vel_theta: PositiveAngularSpeed = 1.0
    """Greatest turn rate."""
    min_speed_xy: NonNegativeSpeed = 0.0
    """What moves slower than this must turn by at least `min_speed_theta`."""
    max_speed_xy: PositiveSpeed | None = None
    """Greatest speed in any direction; default: `max_vel_x`."""
    min_speed_theta: NonNegativeAngularSpeed = 0.0
    """What turns slower than this must move by at least `min_speed_xy`."""
    acc_lim_x: PositiveAcceleration | None = None
    """Default: the robot's own limit; so are those below."""
    acc_lim_y: SidewaysAcceleration | None = None
    """Sideways; 0 for a base that cannot."""
    acc_lim_theta: PositiveAngularAcceleration | None = None
    """Of its turn rate."""
    decel_lim_x: Deceleration | None = None
    """Towards lower speeds, negative."""
    decel_lim_y: SidewaysDeceleration | None = None
    """Sideways, to the right, negative; 0 for a base that cannot."""
    decel_lim_theta: AngularDeceleration | None = None
    """Of its turn rate, to the right, negative."""
    vx_samples: Annotated[int, Field(ge=0, le=200)] = 20
    """Speeds forward that are tried; two at least, as in Nav2."""
    vy_samples: Annotated[int, Field(ge=0, le=200)] = 5
    """Speeds sideways that are tried, where the base can do any; two at least, as in Nav2."""
    vtheta_samples: Annotated[int, Field(ge=0, le=200)] = 20
    """Turn rates that are tried; two at least, as in Nav2."""
    sim_time: PositiveDuration = 1.7
    """How far ahead each is followed."""
    linear_granularity: Annotated[Length, Field(ge=0.01, le=10)] = 0.05
    """At most so far between two poses of a trajectory."""
    angular_granularity: Annotated[Angle, Field(ge=0.005, le=10)] = 0.025
    """And at most such a turn."""
    trans_stopped_velocity: NonNegativeSpeed = 0.25
    """At the goal it turns to its heading from this speed down."""
    prune_distance: PositiveLength = 1.5
    """How much of the plan ahead it looks at, at least (Nav2: 2 m, of which its costmap shows 1.5 m)."""
    base_obstacle_scale: Weight = 0.02
    """Weight of the costs at the end of a trajectory."""
    path_align_scale: Weight = 32.0
    """Weight of how far its front is from the plan."""
    path_dist_scale: Weight = 32.0
    """Weight of how far it is from the plan."""
    goal_align_scale: Weight = 24.0
    """Weight of how far its front is from the plan's end."""
    goal_dist_scale: Weight = 24.0
    """Weight of how far it is from the plan's end."""
    rotate_to_goal_scale: Weight = 32.0
    """Weight of how far it is off the goal's heading, at the goal; 0: it does not stop there to turn."""
    slowing_factor: Weight = 5.0
    """Weight of its speed, while it comes to rest at the goal before it turns."""
    twirling_scale: Weight = 0.0
    """Weight of how fast it turns: keeps an omnidirectional base from spinning as it goes."""
    forward_point_distance: NonNegativeLength = 0.1
    """How far ahead of its middle its front is."""
    oscillation_reset_dist: NonNegativeLength = 0.05
    """What went to and fro may go back again once it has come this far."""
    oscillation_reset_angle: Annotated[Angle, Field(ge=0)] = 0.2
    """Or has turned this far."""
    x_only_threshold: NonNegativeSpeed = 0.05
    """Turning to and fro counts only below this speed."""

    @property
    def looks_ahead(self) -> float:
        """As far as its trajectories."""
        return self.sim_time


_Controllers = Annotated[
    Annotated[RegulatedPurePursuit, Tag("regulated_pure_pursuit")]
    | Annotated[DynamicWindow, Tag("dwb")]
    | Annotated[Mppi, Tag("mppi")],
    Discriminator(type_discriminator("regulated_pure_pursuit")),
]
Controller = Annotated[ControllerSpec, ExtensibleUnion("controller", _Controllers)]
CONTROLLERS = {
    "regulated_pure_pursuit": "simscen.model.controllers:RegulatedPurePursuit",
    "dwb": "simscen.model.controllers:DynamicWindow",
    "mppi": "simscen.model.mppi:Mppi",
}
