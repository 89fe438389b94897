"""The navigation stack's parameters, with Nav2's names and defaults."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from simscen.model.checkers import GoalChecker, ProgressChecker
from simscen.model.controllers import Controller
from simscen.model.costmaps import Costmap, LocalCostmap
from simscen.model.guards import CollisionMonitor, Prediction, VelocitySmoother
from simscen.model.latency import Latency
from simscen.model.localizers import GroundTruth, Localizer
from simscen.model.planners import Planner
from simscen.model.profiles import PROFILES, Profile, with_profile
from simscen.model.recovery import Recovery
from simscen.model.stack_base import StackBase
from simscen.spec.base import Typed, by_default
from simscen.spec.quantities import (
    Quantity,
)

Patience = Annotated[float, Field(ge=-1, le=86400), Quantity("duration")]


ParameterFile = Annotated[str, Field(min_length=1, max_length=4096)]


_LatencyOrRobots = Annotated[
    Annotated[Literal["robot"], Tag("a name")] | Annotated[Latency, Tag("durations")],
    Discriminator(lambda value: "a name" if isinstance(value, str) else "durations"),
]


REFERENCE_BUILDER = "simscen.stack.build:StackBuilder"
ADVANCED_BUILDER = "simscen.advanced.build:AdvancedStackBuilder"


class InProcessStack(StackBase, Typed):
    """A whole stack that lives in the process of its run: simscen's own, or one that an installed package adds."""


class StackSpec(InProcessStack):
    """The navigation stack under test: Nav2 in miniature."""

    component: ClassVar[str] = "simscen.stack.build:configured_stack"
    type: Literal["reference"] = "reference"
    profile: Profile = "reference"
    """Default values of the other parameters. `nav2`: those of nav2_bringup. `advanced`: those that choose the
    components that Nav2 does not have, such as motion prediction and scan matching. `simscen` is the deprecated name
    of `advanced`."""
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
    def builder(self) -> str:
        """The builder of the stack as `module:class`: that of the advanced stack if any parameter asks for it."""
        is_advanced = (
            self.prediction.enabled
            or self.planner.cautious
            or not self.recovery.clear_entirely
            or (self.velocity_smoother.counter_turn_slip and self.localizer.fuses_odometry)
        )
        return ADVANCED_BUILDER if is_advanced else REFERENCE_BUILDER

    @property
    def told_truth(self) -> bool:
        """Whether its localizer is told where the robot truly is."""
        return isinstance(self.localizer, GroundTruth)


STACKS = {"reference": "simscen.model.stack:StackSpec"}
