"""What must hold, without all of the scenario around it."""

from simscen.core.records.verdict import ExpectedFailure
from simscen.model.scenario import RobotEntry, ScenarioSpec, WorldOrFile
from simscen.spec.base import LanguageVersion


def expectation_of(spec: ScenarioSpec) -> ExpectedFailure | None:
    """That a run is known to fail, wherever that is written."""
    return None if spec.expected is None else ExpectedFailure(spec.expected.fail, tuple(spec.expected.criteria))


class CriteriaSpec(ScenarioSpec):
    """A scenario of which only `pass` need be there: enough to judge a log that exists already."""

    simscen: LanguageVersion = 1
    """Version of this language."""
    world: WorldOrFile | None = None  # type: ignore[assignment]
    """Whose places and regions are meant; only a log that is not simscen's own needs it."""
    robot: RobotEntry | None = None
    """Whose footprint it is; only a log that is not simscen's own needs it."""
