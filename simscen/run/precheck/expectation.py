"""Which failures a scenario asks for: what a robot is to refuse need not be possible."""

from collections.abc import Iterator

from simscen.core.navigation import ErrorCode
from simscen.criteria.result import ErrorCodeIs, Result
from simscen.model.scenario import ScenarioSpec

AT_THE_START = ErrorCode.START_OCCUPIED, ErrorCode.START_OUTSIDE_MAP


def expects_failure(spec: ScenarioSpec, goal: str) -> bool:
    """Whether the scenario passes when the robot fails at this goal.

    It does by the result or the code of the navigation as a whole, or by the code of this goal.
    """
    results = [entry.chosen for entry in spec.pass_ if entry.severity == "fail"]
    failing = any(isinstance(result, Result) and result.status == "FAILED" for result in results)
    return failing or any(code != ErrorCode.NONE and of in (None, goal) for code, of in _codes(spec))


def expects_bad_start(spec: ScenarioSpec) -> bool:
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
