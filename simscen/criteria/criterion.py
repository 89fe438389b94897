"""The list of criteria: a new one is one file and one line here."""

from typing import ClassVar, Literal

from simscen.criteria.goals_reached import GoalsReached
from simscen.spec.base import Choice
from simscen.spec.places import Name


class AnyCriterion(Choice):
    """One pass criterion."""

    modifiers: ClassVar[frozenset[str]] = frozenset({"id", "severity"})

    id: Name | None = None
    """What the verdict is called in reports; default: the criterion's key."""
    severity: Literal["fail", "warn"] = "fail"
    """Whether a violation fails the run or is only reported."""

    goals_reached: GoalsReached | None = None
