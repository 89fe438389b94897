"""The list of criteria: a new one is one file and one line here."""

from typing import ClassVar, Literal

from simscen.criteria.clearance import Clearance
from simscen.criteria.collisions import Collisions
from simscen.criteria.goals_reached import GoalsReached
from simscen.criteria.keepout import Keepout
from simscen.criteria.localization_error import LocalizationError
from simscen.criteria.no_false_success import NoFalseSuccess
from simscen.criteria.path_length import PathLength
from simscen.criteria.recoveries import Recoveries
from simscen.criteria.relocalized_within import RelocalizedWithin
from simscen.criteria.replans import Replans
from simscen.criteria.result import ErrorCodeIs, Result
from simscen.criteria.speed import Speed
from simscen.criteria.stopped_within import StoppedWithin
from simscen.criteria.stuck import Stuck
from simscen.criteria.time_to_goal import TimeToGoal
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
    result: Result | None = None
    error_code: ErrorCodeIs | None = None
    no_false_success: NoFalseSuccess | None = None
    collisions: Collisions | None = None
    clearance: Clearance | None = None
    keepout: Keepout | None = None
    time_to_goal: TimeToGoal | None = None
    path_length: PathLength | None = None
    speed: Speed | None = None
    stopped_within: StoppedWithin | None = None
    stuck: Stuck | None = None
    localization_error: LocalizationError | None = None
    relocalized_within: RelocalizedWithin | None = None
    replans: Replans | None = None
    recoveries: Recoveries | None = None
