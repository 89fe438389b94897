"""Specification of simscen's navigation stack, with Nav2's parameter names."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from simscen.model.controllers import Controller, GoalChecker, ProgressChecker
from simscen.model.costmaps import Costmap, LocalCostmap, Prediction
from simscen.model.localizers import GroundTruth, Localizer, OdometryFilter
from simscen.model.planners import Planner
from simscen.model.profiles import Profile, apply_profile
from simscen.model.recovery import Recovery
from simscen.model.stack_base import Latency, StackBase
from simscen.model.velocity_commands import CollisionMonitor, VelocitySmoother
from simscen.spec.base import Typed, by_default, text_or_mapping
from simscen.spec.places import FilePath
from simscen.spec.quantities import NonNegativeAngularSpeed, NonNegativeSpeed, Quantity

_LatencyOrRobot = Annotated[
    Annotated[Literal["robot"], Tag("a text")] | Annotated[Latency, Tag("a mapping")], Discriminator(text_or_mapping)
]
REFERENCE_BUILDER = "simscen.stack.build:StackBuilder"
"""Class that builds the reference stack from its specification, as `module:Class`."""
ADVANCED_BUILDER = "simscen.advanced.stack:AdvancedStackBuilder"
"""Class that builds the advanced stack from its specification, as `module:Class`."""


class InProcessStack(StackBase, Typed):
    """Base class of the specifications of stacks that run in the process of the simulation."""


class StackSpec(InProcessStack):
    """Navigation stack of simscen, modeled on Nav2."""

    component: ClassVar[str] = "simscen.stack.build:configured_stack"
    type: Literal["reference"] = "reference"
    profile: Profile = "reference"
    """Set of default values for the other parameters. `nav2`: the values of nav2_bringup. `advanced`: components that
    Nav2 does not have, such as motion prediction and scan matching. `simscen`: deprecated name of `advanced`."""
    nav2_params: FilePath | None = None
    """Parameter file of Nav2, such as nav2_params.yaml. Parameters that do not exist here are ignored."""
    localizer: Localizer = by_default()
    """Localizer, which estimates the pose of the robot."""
    odometry: OdometryFilter = by_default()
    """Source of the transform from odom to base."""
    costmap: Costmap = by_default()
    """Global costmap for planning. Its values are also the defaults of the local costmap."""
    local_costmap: LocalCostmap = by_default()
    """Local costmap for control and recovery behaviors."""
    planner: Planner = by_default()
    """Planner of the global path."""
    controller: Controller = by_default()
    """Controller that follows the path."""
    failure_tolerance: Annotated[float, Field(ge=-1, le=86400), Quantity("duration")] = 0.3
    """Time without a valid command after which the controller fails with PATIENCE_EXCEEDED. 0: the controller fails
    immediately with NO_VALID_CONTROL. -1: the controller never fails."""
    min_x_velocity_threshold: NonNegativeSpeed = 0.0
    """Deadband of the measured forward speed: the controller and the goal checker get 0 for speeds up to this value
    (Nav2: 0.0001)."""
    min_y_velocity_threshold: NonNegativeSpeed = 0.0
    """Deadband of the measured sideways speed (Nav2: 0.0001)."""
    min_theta_velocity_threshold: NonNegativeAngularSpeed = 0.0
    """Deadband of the measured turn rate (Nav2: 0.0001)."""
    goal_checker: GoalChecker = by_default()
    """Checker that decides whether a goal is reached."""
    progress_checker: ProgressChecker = by_default()
    """Checker that detects that the robot makes no progress."""
    recovery: Recovery = by_default()
    """Recovery behaviors after planning or control has failed."""
    velocity_smoother: VelocitySmoother = by_default()
    """Limits of the acceleration and velocity of commands."""
    collision_monitor: CollisionMonitor = by_default()
    """Monitor that stops or slows the robot before a collision."""
    latency: _LatencyOrRobot = by_default()
    """Computing times of the stack, or `robot` for the computing times and sensor delays of the robot file."""
    prediction: Prediction = by_default()
    """Prediction of moving obstacles."""

    @model_validator(mode="before")
    @classmethod
    def _apply_profile(cls, parameters: Any) -> Any:
        return apply_profile(parameters) if isinstance(parameters, Mapping) else parameters

    @property
    def builder(self) -> str:
        """Class that builds the stack, as `module:Class`: ADVANCED_BUILDER if a parameter needs the advanced stack."""
        needs_advanced_stack = (
            self.prediction.enabled
            or self.planner.cautious
            or not self.recovery.clear_entirely
            or (self.velocity_smoother.counter_turn_slip and self.localizer.fuses_odometry)
        )
        return ADVANCED_BUILDER if needs_advanced_stack else REFERENCE_BUILDER

    def filters_odometry(self, has_imu: bool) -> bool:
        """Return whether the odometry filter fuses wheel odometry and IMU."""
        return self.odometry.type == "ekf" and has_imu and not self.localizer.fuses_odometry

    @property
    def gets_ground_truth(self) -> bool:
        """Whether the localizer receives the true pose."""
        return isinstance(self.localizer, GroundTruth)


STACKS = {"reference": "simscen.model.stack:StackSpec"}
"""Specifications of the shipped stacks as `module:Class`, by type."""
