"""Goals of a scenario: listed under `goals`, or sent by events during the run."""

import math
from collections.abc import Callable
from dataclasses import replace

from simscen.actions.robot import NewGoal
from simscen.core.messages.navigation import Goal, loop_goal_name
from simscen.loading.yaml.tree import Keys
from simscen.model.navigation import expected_failure_name
from simscen.model.scenario import GoalEntry, ScenarioSpec
from simscen.model.stack_base import StackBase


def scenario_goals(spec: ScenarioSpec) -> tuple[Goal, ...]:
    """Return the goals listed under `goals`, repeated for each loop of the navigation.

    The names in the second loop end in `#2`, in the third in `#3`, and so on. Missing tolerances are taken from the
    goal checker.
    """
    goals = [_goal(name, entry, spec.stack) for name, entry in zip(spec.goal_names, spec.goals, strict=True)]
    if spec.navigation.mode == "navigate_through_poses":
        intermediate = [
            _intermediate_goal(goal, entry, spec.navigation.radius)
            for goal, entry in zip(goals, spec.goals, strict=True)
        ]
        goals = [*intermediate[:-1], *goals[-1:]]
    return tuple(
        replace(goal, name=loop_goal_name(goal.name, loop))
        for loop in range(1, spec.navigation.loops + 1)
        for goal in goals
    )


def expected_failures(spec: ScenarioSpec, goals: tuple[Goal, ...]) -> dict[str, str]:
    """Return the expected failures, such as "NO_VALID_PATH", by name of the goals that are expected to fail.

    `goals` is the result of `scenario_goals`. With navigate_through_poses, the expectation of the last goal applies to
    all goals.
    """
    through = spec.navigation.mode == "navigate_through_poses"
    found = {}
    for number, goal in enumerate(goals):
        entry = spec.goals[-1] if through else spec.goals[number % len(spec.goals)]
        if failure := expected_failure_name(entry.expect):
            found[goal.name] = failure
    return found


def _intermediate_goal(goal: Goal, entry: GoalEntry, radius: float) -> Goal:
    """Return `goal` as a via pose: to pass at any heading, within `radius` m unless `entry` sets a tolerance."""
    return replace(goal, via=True, xy_tolerance=entry.xy_tolerance or radius, yaw_tolerance=math.pi)


def event_goals(spec: ScenarioSpec, includes_robot: Callable[[str | None], bool]) -> dict[Keys, Goal]:
    """Return the goals that events send, by the keys of their `new_goal` actions in the scenario.

    `includes_robot` selects actions: it is called with the robot that an action names, or None.
    """
    checker = spec.stack.goal_checker
    found: dict[Keys, Goal] = {}
    for keys, action in (located for step in spec.steps for located in step.located_actions()):
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
    """Return a listed goal. Missing tolerances are taken from the goal checker of the stack."""
    return Goal(
        name=name,
        pose=entry.pose.pose,
        xy_tolerance=entry.xy_tolerance or stack.goal_checker.xy_goal_tolerance,
        yaw_tolerance=entry.yaw_tolerance or stack.goal_checker.yaw_goal_tolerance,
        timeout=entry.timeout,
        wait=entry.on_reached.wait,
    )
