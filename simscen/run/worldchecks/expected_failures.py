"""Failures that a scenario expects: such a goal need not be reachable."""

from collections.abc import Iterator

from simscen.core.messages.goal_names import matches_goal_name
from simscen.core.messages.navigation import ErrorCode
from simscen.criteria.result import ErrorCodeIs, Result
from simscen.model.navigation import failure_of
from simscen.model.scenario import ScenarioSpec

START_FAILURES = ErrorCode.START_OCCUPIED, ErrorCode.START_OUTSIDE_MAP


def expects_failure(spec: ScenarioSpec, goal: str) -> bool:
    """Return whether the scenario passes if the robot fails at this goal.

    The scenario says so with `expect` at the goal, with the result or the error code of the whole navigation, or with
    the error code of this goal.
    """
    through = spec.navigation.mode == "navigate_through_poses"
    entries = zip(spec.goal_names, [spec.goals[-1]] * len(spec.goals) if through else spec.goals, strict=True)
    if any(matches_goal_name(goal, name) and failure_of(entry.expect) for name, entry in entries):
        return True
    results = [entry.chosen for entry in spec.pass_ if entry.severity == "fail"]
    failing = any(isinstance(result, Result) and result.status == "FAILED" for result in results)
    return failing or any(code != ErrorCode.NONE and of in (None, goal) for code, of in _codes(spec))


def expects_start_failure(spec: ScenarioSpec) -> bool:
    """Return whether the scenario passes if the robot cannot start."""
    return any(code in START_FAILURES for code, _ in _codes(spec))


def _codes(spec: ScenarioSpec) -> Iterator[tuple[ErrorCode, str | None]]:
    """Return each error code that a criterion asks for, and its goal; None: the whole navigation."""
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
