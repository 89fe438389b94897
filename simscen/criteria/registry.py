"""Specification of an entry of `pass`, with one field for each criterion."""

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, model_validator

from simscen.core.records.verdict import unique_name
from simscen.criteria.base import Criterion
from simscen.spec.base import LazySpec
from simscen.spec.choice import Choice
from simscen.spec.places import Name


class AnyCriterion(Choice):
    """Entry of `pass`: exactly one criterion with its modifiers."""

    group: ClassVar[str] = "criterion"
    modifiers: ClassVar[frozenset[str]] = frozenset({"id", "severity", "then"})

    id: Name | None = None
    """Name of the verdict in reports; default: the key of the criterion."""
    severity: Literal["fail", "warn"] = "fail"
    """Effect of a violation: `fail` fails the run, `warn` only reports the violation."""
    then: Annotated[BaseModel | None, LazySpec("simscen.criteria.stl.condition", "Condition")] = None
    """Condition that must be true whenever the condition `whenever` is true."""

    goals_reached: Annotated[Criterion | None, LazySpec("simscen.criteria.goals_reached", "GoalsReached")] = None
    result: Annotated[Criterion | None, LazySpec("simscen.criteria.result", "Result")] = None
    error_code: Annotated[Criterion | None, LazySpec("simscen.criteria.result", "ErrorCodeIs")] = None
    no_false_success: Annotated[Criterion | None, LazySpec("simscen.criteria.result", "NoFalseSuccess")] = None
    collisions: Annotated[Criterion | None, LazySpec("simscen.criteria.collisions", "Collisions")] = None
    clearance: Annotated[Criterion | None, LazySpec("simscen.criteria.clearance", "Clearance")] = None
    personal_space: Annotated[Criterion | None, LazySpec("simscen.criteria.clearance", "PersonalSpace")] = None
    keepout: Annotated[Criterion | None, LazySpec("simscen.criteria.keepout", "Keepout")] = None
    time_to_goal: Annotated[Criterion | None, LazySpec("simscen.criteria.efficiency", "TimeToGoal")] = None
    path_length: Annotated[Criterion | None, LazySpec("simscen.criteria.efficiency", "PathLength")] = None
    speed: Annotated[Criterion | None, LazySpec("simscen.criteria.speed", "Speed")] = None
    stopped_within: Annotated[Criterion | None, LazySpec("simscen.criteria.stopping", "StoppedWithin")] = None
    stuck: Annotated[Criterion | None, LazySpec("simscen.criteria.stopping", "Stuck")] = None
    localization_error: Annotated[Criterion | None, LazySpec("simscen.criteria.localization", "LocalizationError")] = (
        None
    )
    relocalized_within: Annotated[Criterion | None, LazySpec("simscen.criteria.localization", "RelocalizedWithin")] = (
        None
    )
    localization_consistency: Annotated[
        Criterion | None, LazySpec("simscen.criteria.localization", "LocalizationConsistency")
    ] = None
    smoothness: Annotated[Criterion | None, LazySpec("simscen.criteria.smoothness", "Smoothness")] = None
    replans: Annotated[Criterion | None, LazySpec("simscen.criteria.event_counts", "Replans")] = None
    recoveries: Annotated[Criterion | None, LazySpec("simscen.criteria.event_counts", "Recoveries")] = None
    always: Annotated[Criterion | None, LazySpec("simscen.criteria.temporal", "Always")] = None
    eventually: Annotated[Criterion | None, LazySpec("simscen.criteria.temporal", "Eventually")] = None
    until: Annotated[Criterion | None, LazySpec("simscen.criteria.temporal", "Until")] = None
    whenever: Annotated[BaseModel | None, LazySpec("simscen.criteria.stl.condition", "Whenever")] = None

    @model_validator(mode="after")
    def _check_whenever_and_then(self) -> "AnyCriterion":
        if (self.whenever is None) != (self.then is None):
            raise ValueError("`whenever` and `then` must be given together")
        return self

    @property
    def chosen(self) -> Any:
        """The specification of the criterion. The keys `whenever` and `then` are combined into one Response."""
        if self.whenever is None:
            return super().chosen
        from simscen.criteria.temporal import Response

        return Response.of(self.whenever, self.then)


def verdict_names(criteria: Sequence[AnyCriterion]) -> list[str]:
    """Return the verdict name of each criterion: its `id`, or its key. A repeated name gets a number: speed#2."""
    names: set[str] = set()
    return [unique_name(entry.id or entry.kind, names) for entry in criteria]
