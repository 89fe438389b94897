"""Goals of a scenario."""

import math
from collections.abc import Callable
from dataclasses import replace

from simscen.actions.robot import NewGoal
from simscen.core.messages.navigation import Goal, loop_goal_name
from simscen.model.navigation import expected_failure_name
from simscen.model.scenario import GoalEntry, ScenarioSpec
from simscen.model.stack_base import StackBase


def scenario_goals(spec: ScenarioSpec) -> tuple[Goal, ...]:
    """Return all goals in order, with names and tolerances; names in further loops end in `#2`, `#3`, …"""
    goals = [_goal(name, entry, spec.stack) for name, entry in zip(spec.goal_names, spec.goals, strict=True)]
    if spec.navigation.mode == "navigate_through_poses":
        via = [
            _intermediate_goal(goal, entry, spec.navigation.radius)
            for goal, entry in zip(goals, spec.goals, strict=True)
        ]
        goals = [*via[:-1], *goals[-1:]]
    return tuple(
        replace(goal, name=loop_goal_name(goal.name, loop))
        for loop in range(1, spec.navigation.loops + 1)
        for goal in goals
    )


def expected_failures(spec: ScenarioSpec, goals: tuple[Goal, ...]) -> dict[str, str]:
    """Return the expected failure by goal; navigate_through_poses fails at all goals or none."""
    through = spec.navigation.mode == "navigate_through_poses"
    found = {}
    for number, goal in enumerate(goals):
        entry = spec.goals[-1] if through else spec.goals[number % len(spec.goals)]
        if failure := expected_failure_name(entry.expect):
            found[goal.name] = failure
    return found


def _intermediate_goal(goal: Goal, entry: GoalEntry, radius: float) -> Goal:
    """Return a goal as navigate_through_poses passes it: within `radius` m, at any heading."""
    return replace(goal, via=True, xy_tolerance=entry.xy_tolerance or radius, yaw_tolerance=math.pi)


def event_goals(spec: ScenarioSpec, includes_robot: Callable[[str | None], bool]) -> dict[tuple[str | int, ...], Goal]:
    """Return the goals that events send to robots for which `includes_robot` is true, by path in the scenario file."""
    checker = spec.stack.goal_checker
    found: dict[tuple[str | int, ...], Goal] = {}
    for keys, action in (placed for step in spec.steps for placed in step.located_actions()):
        if isinstance(sent := action.chosen, NewGoal) and includes_robot(action.robot):
            where = (*keys, "new_goal")
            found[where] = Goal(
                name=sent.name,
                pose=sent.pose.pose,
                xy_tolerance=sent.xy_tolerance or checker.xy_goal_tolerance,
                yaw_tolerance=sent.yaw_tolerance or checker.yaw_goal_tolerance,
                timeout=sent.timeout,
            )
    return found


def _goal(name: str, entry: GoalEntry, stack: StackBase) -> Goal:
    return Goal(
        name=name,
        pose=entry.pose.pose,
        xy_tolerance=entry.xy_tolerance or stack.goal_checker.xy_goal_tolerance,
        yaw_tolerance=entry.yaw_tolerance or stack.goal_checker.yaw_goal_tolerance,
        timeout=entry.timeout,
        wait=entry.on_reached.wait,
    )
