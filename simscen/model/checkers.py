"""What says that a goal is reached, and that the robot does not get on (nav2_controller's checkers)."""

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
    """What says whether a goal is reached; the tolerances are those of goals that name none."""


class SimpleGoalChecker(GoalCheckerSpec):
    """nav2_controller::SimpleGoalChecker."""

    component: ClassVar[str] = "simscen.stack.checkers:SimpleGoalChecker"
    type: Literal["simple"] = "simple"
    stateful: bool = True
    """Once the position was reached only the heading counts."""
    well_inside: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 1.0
    """While it moves, the robot has arrived within this share of the tolerances; at rest, anywhere inside. Nav2: 1."""


GoalChecker = Annotated[GoalCheckerSpec, ExtensibleUnion("goal_checker", SimpleGoalChecker)]


class ProgressChecker(Spec):
    """nav2_controller::SimpleProgressChecker, or PoseProgressChecker when an angle is given."""

    required_movement_radius: PositiveLength = 0.5
    """How far it must move within the time allowed."""
    required_movement_angle: PositiveAngle | None = None
    """Or how far it must turn, where that counts as progress."""
    movement_time_allowance: PositiveDuration = 10.0
    """In how long; then driving fails with FAILED_TO_MAKE_PROGRESS."""


GOAL_CHECKERS = {"simple": "simscen.model.checkers:SimpleGoalChecker"}
