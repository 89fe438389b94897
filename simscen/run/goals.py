"""Where a scenario starts and what it is sent to, as its world places them."""

from simscen.actions.goals import NewGoal
from simscen.core.geometry import Pose2
from simscen.core.navigation import Goal
from simscen.core.world import World
from simscen.model.scenario import GoalEntry, ScenarioSpec
from simscen.model.stackbase import StackBase
from simscen.spec.places import PoseSpec


def pose_of(place: str | PoseSpec, world: World) -> Pose2:
    """A pose as written, or that of a place of the world."""
    return world.places[place] if isinstance(place, str) else place.pose


def goals_of(spec: ScenarioSpec, world: World) -> tuple[Goal, ...]:
    """The goals in order, named, with their tolerances."""
    return tuple(_goal(number, entry, spec.stack, world) for number, entry in enumerate(spec.goals, start=1))


def sent_goals(spec: ScenarioSpec) -> dict[tuple[str | int, ...], Goal]:
    """The goals that events send, by where each is written, in the order of the file."""
    checker = spec.stack.goal_checker
    found: dict[tuple[str | int, ...], Goal] = {}
    for keys, action in (placed for step in spec.steps for placed in step.placed()):
        if isinstance(sent := action.chosen, NewGoal):
            where = (*keys, "new_goal")
            found[where] = Goal(
                name=sent.name,
                pose=sent.pose.pose,
                xy_tolerance=sent.xy_tolerance or checker.xy_goal_tolerance,
                yaw_tolerance=sent.yaw_tolerance or checker.yaw_goal_tolerance,
                timeout=sent.timeout,
            )
    return found


def _goal(number: int, entry: GoalEntry, stack: StackBase, world: World) -> Goal:
    place = entry.pose if isinstance(entry.pose, str) else f"goal-{number}"
    return Goal(
        name=entry.name or place,
        pose=pose_of(entry.pose, world),
        xy_tolerance=entry.xy_tolerance or stack.goal_checker.xy_goal_tolerance,
        yaw_tolerance=entry.yaw_tolerance or stack.goal_checker.yaw_goal_tolerance,
        timeout=entry.timeout,
    )
