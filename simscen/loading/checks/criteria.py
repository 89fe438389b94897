"""Criteria that no run can pass: they ask for what cannot be, or contradict each other."""

from collections.abc import Iterator
from typing import Any

from simscen.core.problems import Problem
from simscen.loading.checks.events import no_recovery
from simscen.loading.known_names import goal_names
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Key
from simscen.model.navigation import failure_of

Keys = tuple[Key, ...]
ABOUT_GOALS = frozenset({"goals_reached", "time_to_goal", "no_false_success", "stuck", "result", "error_code"})
"""Criteria that have nothing to judge where the robot is sent nowhere."""
NONE = 0
"""The error code of no error."""


def never_holds(loaded: LoadedScenario) -> Iterator[Problem]:
    """Every criterion, or pair of criteria, that no run can pass."""
    for index, entry in enumerate(loaded.spec.pass_):
        keys: Keys = ("pass", index, entry.kind)
        check = _CHECKS.get(entry.kind)
        why = _without_goals(loaded, entry.kind, entry.chosen) or (check(loaded, entry.chosen) if check else None)
        if why:
            yield loaded.problem_at(loaded.key_place_of(*keys), "SC051", f"{entry.kind} can never hold: {why}")
    yield from _contradictions(loaded)
    yield from _never_sent(loaded)


def _without_goals(loaded: LoadedScenario, kind: str, criterion: Any) -> str | None:
    needs = kind in ABOUT_GOALS or (kind == "path_length" and criterion.max_ratio is not None)
    return "the robot is sent to no goal" if needs and not goal_names(loaded) else None


def _result(loaded: LoadedScenario, result: Any) -> str | None:
    cancels = any(action.may("cancel_goal") for step in loaded.spec.steps for action in step.actions)
    if result.status == "CANCELED" and not cancels:
        return "no event cancels a goal"
    if result.status == "SUCCEEDED" and result.error_code not in (None, NONE):
        return f"what has SUCCEEDED has no error code, and so not {result.error_code.name}"
    if result.status == "FAILED" and result.error_code == NONE:
        return "what has FAILED has an error code other than NONE"
    return None


def _recoveries(loaded: LoadedScenario, recoveries: Any) -> str | None:
    return no_recovery(loaded, recoveries.name) if recoveries.min else None


_CHECKS = {"result": _result, "recoveries": _recoveries}


def _never_sent(loaded: LoadedScenario) -> Iterator[Problem]:
    """Goals after one at which the robot is to fail, where a failure is the end."""
    spec = loaded.spec
    again = spec.navigation.loops > 1
    if spec.on_goal_failure == "continue" or any(
        action.may("new_goal") for step in spec.steps for action in step.actions
    ):
        return
    for index, goal in enumerate(spec.goals):
        if failure_of(goal.expect) and (again or index + 1 < len(spec.goals)):
            following = spec.goal_names[(index + 1) % len(spec.goals)]
            message = f"goal `{following}` is never sent: the robot is to fail at the one before it, and stops there"
            yield loaded.problem(("goals", index, "expect"), "SC051", message, "say `on_goal_failure: continue`")
            return


def _contradictions(loaded: LoadedScenario) -> Iterator[Problem]:
    """Results that exclude each other."""
    failing = any(failure_of(goal.expect) for goal in loaded.spec.goals)
    wanted: dict[str, tuple[str, Keys]] = {}
    for index, entry in enumerate(loaded.spec.pass_):
        if entry.severity != "fail":
            continue
        every_goal = entry.kind == "goals_reached" and getattr(entry.chosen, "goals", None) is None and not failing
        status = "SUCCEEDED" if every_goal else str(getattr(entry.chosen, "status", "")) if entry.result else ""
        if not status:
            continue
        keys: Keys = ("pass", index, entry.kind)
        before = next((told for other, told in wanted.items() if other != status), None)
        if before:
            first = loaded.key_place_of(*before[1])
            message = f"{entry.kind} contradicts {before[0]} at {first.line}:{first.col}: no run can pass both"
            yield loaded.problem_at(loaded.key_place_of(*keys), "SC051", message)
        wanted.setdefault(status, (entry.kind, keys))
