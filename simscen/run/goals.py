"""What a scenario's robot is sent to."""

from collections.abc import Callable

from simscen.actions.goals import NewGoal
from simscen.core.navigation import Goal
from simscen.model.scenario import GoalEntry, ScenarioSpec
from simscen.model.stackbase import StackBase


def goals_of(spec: ScenarioSpec) -> tuple[Goal, ...]:
    """The goals in order, named, with their tolerances."""
    return tuple(_goal(name, entry, spec.stack) for name, entry in zip(spec.goal_names, spec.goals, strict=True))


def sent_goals(spec: ScenarioSpec, concerns: Callable[[str | None], bool]) -> dict[tuple[str | int, ...], Goal]:
    """The goals that events send to the robot that `concerns`, by where each is written, in the order of the file."""
    checker = spec.stack.goal_checker
    found: dict[tuple[str | int, ...], Goal] = {}
    for keys, action in (placed for step in spec.steps for placed in step.placed()):
        if isinstance(sent := action.chosen, NewGoal) and concerns(action.robot):
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
    )
