"""Goals of a scenario, listed under `goals` or sent by events, and the expected failures of goals."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from simscen.core.messages.goals import Goal, loop_goal_name, matches_goal_name
from simscen.core.messages.navigation import ErrorCode
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Keys
from simscen.model.navigation import expected_failure_name
from simscen.model.scenario import GoalEntry, ScenarioSpec

if TYPE_CHECKING:
    from simscen.actions.robot import NewGoal

START_FAILURES = ErrorCode.START_OCCUPIED, ErrorCode.START_OUTSIDE_MAP
"""Error codes of planners for a start pose from which no plan is possible."""


def scenario_goals(spec: ScenarioSpec) -> tuple[Goal, ...]:
    """Return the goals under `goals`, repeated for each loop of the navigation, with names such as `shelf#2`."""
    goals = []
    for number, (name, entry) in enumerate(zip(spec.goal_names, spec.goals, strict=True), start=1):
        goal = replace(_goal(name, entry, spec), wait=entry.on_reached.wait)
        if spec.navigation.mode == "navigate_through_poses" and number < len(spec.goals):
            tolerance = entry.xy_tolerance or spec.navigation.radius
            goal = replace(goal, via=True, xy_tolerance=tolerance, yaw_tolerance=math.pi)  # passed at any heading
        goals.append(goal)
    return tuple(
        replace(goal, name=loop_goal_name(goal.name, loop))
        for loop in range(1, spec.navigation.loops + 1)
        for goal in goals
    )


def event_goals(loaded: LoadedScenario) -> dict[Keys, Goal]:
    """Return the goals that events send, by the keys of their `new_goal` actions in the scenario."""
    new_goals = (action for action in loaded.actions if action.kind == "new_goal")
    return {action.keys: _goal(action.spec.name, action.spec, loaded.spec) for action in new_goals}


def _goal(name: str, entry: "GoalEntry | NewGoal", spec: ScenarioSpec) -> Goal:
    """Return a goal. Missing tolerances are taken from the goal checker of the stack."""
    checker = spec.stack.goal_checker
    return Goal(
        name=name,
        pose=entry.pose.pose,
        xy_tolerance=entry.xy_tolerance or checker.xy_goal_tolerance,
        yaw_tolerance=entry.yaw_tolerance or checker.yaw_goal_tolerance,
        timeout=entry.timeout,
    )


def expected_failures(spec: ScenarioSpec, goals: tuple[Goal, ...]) -> dict[str, str]:
    """Return the expected failure, such as "NO_VALID_PATH", of each goal that should fail, by name of the goal.

    `goals` are from `scenario_goals`.
    """
    has_via_poses = spec.navigation.mode == "navigate_through_poses"
    found = {}
    for number, goal in enumerate(goals):
        entry = spec.goals[-1] if has_via_poses else spec.goals[number % len(spec.goals)]
        if failure := expected_failure_name(entry.expect):
            found[goal.name] = failure
    return found


def expects_failure(spec: ScenarioSpec, goal: str) -> bool:
    """Return whether `expect` at the goal, or a criterion, states that the goal with this name fails."""
    has_via_poses = spec.navigation.mode == "navigate_through_poses"
    goal_entries = [spec.goals[-1]] * len(spec.goals) if has_via_poses else spec.goals
    entries = zip(spec.goal_names, goal_entries, strict=True)
    if any(matches_goal_name(goal, name) and expected_failure_name(entry.expect) for name, entry in entries):
        return True
    criteria = [entry for entry in spec.pass_ if entry.severity == "fail"]
    if any(entry.kind == "result" and entry.chosen.status == "FAILED" for entry in criteria):
        return True
    return any(code != ErrorCode.NONE and matches_goal_name(goal, name) for code, name in _required_codes(spec))


def expects_start_failure(spec: ScenarioSpec) -> bool:
    """Return whether a scenario requires that navigation fails because of the start pose."""
    return any(code in START_FAILURES for code, _ in _required_codes(spec))


def _required_codes(spec: ScenarioSpec) -> Iterator[tuple[ErrorCode, str | None]]:
    """Yield the error codes that criteria require, with the name of the goal, or None for the whole navigation."""
    for entry in (entry for entry in spec.pass_ if entry.severity == "fail"):
        if entry.kind == "error_code":
            yield entry.chosen.code, entry.chosen.goal
        elif entry.kind == "result" and entry.chosen.error_code is not None:
            yield entry.chosen.error_code, None
