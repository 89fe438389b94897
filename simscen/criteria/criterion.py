"""The list of criteria: a new one is one file and one line here."""

from typing import Annotated, ClassVar, Literal

from simscen.criteria.base import Criterion
from simscen.spec.base import Choice
from simscen.spec.ondemand import OnDemand
from simscen.spec.places import Name


class AnyCriterion(Choice):
    """One pass criterion."""

    modifiers: ClassVar[frozenset[str]] = frozenset({"id", "severity"})

    id: Name | None = None
    """What the verdict is called in reports; default: the criterion's key."""
    severity: Literal["fail", "warn"] = "fail"
    """Whether a violation fails the run or is only reported."""

    goals_reached: Annotated[Criterion | None, OnDemand("simscen.criteria.goals_reached", "GoalsReached")] = None
    result: Annotated[Criterion | None, OnDemand("simscen.criteria.result", "Result")] = None
    error_code: Annotated[Criterion | None, OnDemand("simscen.criteria.result", "ErrorCodeIs")] = None
    no_false_success: Annotated[Criterion | None, OnDemand("simscen.criteria.no_false_success", "NoFalseSuccess")] = (
        None
    )
    collisions: Annotated[Criterion | None, OnDemand("simscen.criteria.collisions", "Collisions")] = None
    clearance: Annotated[Criterion | None, OnDemand("simscen.criteria.clearance", "Clearance")] = None
    keepout: Annotated[Criterion | None, OnDemand("simscen.criteria.keepout", "Keepout")] = None
    time_to_goal: Annotated[Criterion | None, OnDemand("simscen.criteria.time_to_goal", "TimeToGoal")] = None
    path_length: Annotated[Criterion | None, OnDemand("simscen.criteria.path_length", "PathLength")] = None
    speed: Annotated[Criterion | None, OnDemand("simscen.criteria.speed", "Speed")] = None
    stopped_within: Annotated[Criterion | None, OnDemand("simscen.criteria.stopped_within", "StoppedWithin")] = None
    stuck: Annotated[Criterion | None, OnDemand("simscen.criteria.stuck", "Stuck")] = None
    localization_error: Annotated[
        Criterion | None, OnDemand("simscen.criteria.localization_error", "LocalizationError")
    ] = None
    relocalized_within: Annotated[
        Criterion | None, OnDemand("simscen.criteria.relocalized_within", "RelocalizedWithin")
    ] = None
    replans: Annotated[Criterion | None, OnDemand("simscen.criteria.replans", "Replans")] = None
    recoveries: Annotated[Criterion | None, OnDemand("simscen.criteria.recoveries", "Recoveries")] = None
