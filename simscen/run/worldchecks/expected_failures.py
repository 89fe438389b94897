"""Which failures a scenario asks for: what a robot is to refuse need not be possible."""

from collections.abc import Iterator

from simscen.core.goalnames import named
from simscen.core.navigation import ErrorCode
from simscen.criteria.result import ErrorCodeIs, Result
from simscen.model.navigation import failure_of
from simscen.model.scenario import ScenarioSpec

AT_THE_START = ErrorCode.START_OCCUPIED, ErrorCode.START_OUTSIDE_MAP


def expects_failure(spec: ScenarioSpec, goal: str) -> bool:
    """Whether the scenario passes when the robot fails at this goal.

    It does by what it expects of the goal, by the result or the code of the navigation as a whole, or by the code of
    this goal.
    """
    through = spec.navigation.mode == "navigate_through_poses"
    entries = zip(spec.goal_names, [spec.goals[-1]] * len(spec.goals) if through else spec.goals, strict=True)
    if any(named(goal, name) and failure_of(entry.expect) for name, entry in entries):
        return True
    results = [entry.chosen for entry in spec.pass_ if entry.severity == "fail"]
    failing = any(isinstance(result, Result) and result.status == "FAILED" for result in results)
    return failing or any(code != ErrorCode.NONE and of in (None, goal) for code, of in _codes(spec))


def expects_start_failure(spec: ScenarioSpec) -> bool:
    """Whether the scenario passes when the robot says that it cannot even start."""
    return any(code in AT_THE_START for code, _ in _codes(spec))


def _codes(spec: ScenarioSpec) -> Iterator[tuple[ErrorCode, str | None]]:
    """Each error code that a criterion asks for, and of which goal; None = of the navigation as a whole."""
    for entry in spec.pass_:
        if entry.severity != "fail":
            continue
        match entry.chosen:
            case ErrorCodeIs(code=code, goal=goal):
                yield code, goal
            case Result(error_code=ErrorCode() as code):
                yield code, None
            case _:
                pass
