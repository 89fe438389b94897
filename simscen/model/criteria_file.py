"""Specification of criteria without a scenario, for logs that already exist."""

from simscen.core.records.verdict import ExpectedFailure
from simscen.model.scenario import RobotEntry, ScenarioSpec, WorldOrFile
from simscen.spec.base import LanguageVersion


def expected_failure(spec: ScenarioSpec) -> ExpectedFailure | None:
    """Return the known failure that a scenario declares, or None."""
    return None if spec.expected is None else ExpectedFailure(spec.expected.fail, tuple(spec.expected.criteria))


class CriteriaSpec(ScenarioSpec):
    """Scenario in which only `pass` is required: enough to evaluate an existing log."""

    simscen: LanguageVersion = 1
    """Version of the scenario language."""
    world: WorldOrFile | None = None  # type: ignore[assignment]
    """World with the places and regions of the criteria; needed only for foreign logs."""
    robot: RobotEntry | None = None
    """Robot with the footprint for the criteria; needed only for foreign logs."""
