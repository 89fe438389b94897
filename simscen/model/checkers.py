"""Specifications of goal checkers and the progress checker (nav2_controller)."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from simscen.model.stack_base import GoalTolerances
from simscen.spec.base import Spec, Typed
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.quantities import (
    PositiveAngle,
    PositiveDuration,
    PositiveLength,
    Quantity,
)


class GoalCheckerSpec(GoalTolerances, Typed):
    """Base class of goal checker specifications. Goals without tolerances have those of the goal checker."""


class SimpleGoalChecker(GoalCheckerSpec):
    """nav2_controller::SimpleGoalChecker."""

    component: ClassVar[str] = "simscen.stack.checkers:SimpleGoalChecker"
    type: Literal["simple"] = "simple"
    stateful: bool = True
    """Whether only the heading counts once the position has been reached."""
    well_inside: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 1.0
    """Fraction of the tolerances within which a moving robot has reached the goal; a robot at rest may be anywhere
    within them. Nav2: 1."""


GoalChecker = Annotated[GoalCheckerSpec, ExtensibleUnion("goal_checker", SimpleGoalChecker)]


class ProgressChecker(Spec):
    """nav2_controller::SimpleProgressChecker, or PoseProgressChecker if an angle is given."""

    required_movement_radius: PositiveLength = 0.5
    """Distance that the robot must move within the time allowance."""
    required_movement_angle: PositiveAngle | None = None
    """Angle that counts as progress, too, if the robot turns by it within the time allowance."""
    movement_time_allowance: PositiveDuration = 10.0
    """Time without progress after which driving fails with FAILED_TO_MAKE_PROGRESS."""


GOAL_CHECKERS = {"simple": "simscen.model.checkers:SimpleGoalChecker"}
