"""Bounds that physics cannot keep: no robot is faster than its top speed, and no way shorter than the shortest."""

import math
from collections.abc import Iterator
from itertools import pairwise

from simscen.core.goalnames import named as is_named
from simscen.core.navigation import Goal
from simscen.core.problems import Problem
from simscen.criteria.registry import AnyCriterion
from simscen.loading.checks.events import top_speed
from simscen.model.robot import RobotSpec
from simscen.run.goals import goals_of
from simscen.run.worldchecks.expected_failures import expects_failure
from simscen.run.worldchecks.routes import RobotRoutes
from simscen.run.worldchecks.scene import Scene

SHORTER = 0.97
"""Share of a way that is driven at least: lengths are within 1 %, and a robot cuts corners with its hull."""
FASTER = 1.02
"""Times its top speed that a robot is at most, by its controllers' overshoot."""
AIDED = ("kidnap", "push", "new_goal", "cancel_goal")
"""Actions after which a robot is elsewhere, faster, or done earlier than by driving to its goals."""


def check_time_bounds(scene: Scene, ways: RobotRoutes) -> list[Problem]:
    """Timeouts, time limits and bounds of criteria that no drive can keep."""
    goals, spec = goals_of(scene.loaded.spec), scene.loaded.robot.spec
    failing = any(expects_failure(scene.loaded.spec, goal.name) for goal in goals)
    if not goals or spec is None or failing or scene.does(*AIDED):
        return []
    stops = (scene.start, *(goal.pose for goal in goals))
    # Long ways break what short ones keep, and never the other way round: if these are fine, the shortest are.
    known = [ways.longest(a, b) for a, b in pairwise(stops)]
    if all(map(math.isfinite, known)) and not list(_broken(scene, goals, spec, known)):
        return []
    exact = [ways.shortest(a, b) for a, b in pairwise(stops)]
    return list(_broken(scene, goals, spec, exact)) if all(map(math.isfinite, exact)) else []


def _broken(scene: Scene, goals: tuple[Goal, ...], robot: RobotSpec, whole: list[float]) -> Iterator[Problem]:
    """What ways of these lengths break."""
    loaded, spec = scene.loaded, scene.loaded.spec
    slack = [0.0, *(goal.xy_tolerance for goal in goals)]
    legs = [max(0.0, SHORTER * leg - a - b) for leg, (a, b) in zip(whole, pairwise(slack), strict=True)]
    speed = FASTER * top_speed(robot)
    told = f"at the robot's top speed of {top_speed(robot):g} m/s"
    for index, goal in enumerate(goals[: len(spec.goals)]):
        first_or_alone = index == 0 or spec.on_goal_failure == "stop"
        if goal.timeout is not None and legs[index] / speed > goal.timeout and first_or_alone:
            what = f"goal `{goal.name}` cannot be reached within {goal.timeout:g} s"
            why = f"the way of {whole[index]:.2f} m takes {whole[index] / top_speed(robot):.1f} s {told}"
            yield loaded.problem(("goals", index, "timeout"), "SC303", f"{what}: {why}")
    drive = f"the way of {sum(whole):.2f} m through all goals takes {sum(whole) / top_speed(robot):.1f} s {told}"
    waits = sum(goal.wait for goal in goals)
    if sum(legs) / speed + waits > spec.time_limit and any(map(_asks_for_success, spec.pass_)):
        keys = ("time_limit",) if "time_limit" in spec.model_fields_set else ("goals",)
        waiting = f", and {waits:g} s are waited at them" if waits else ""
        message = f"the goals cannot be reached within {spec.time_limit:g} s: {drive}{waiting}"
        yield loaded.problem(keys, "SC303", message)
    for index, entry in enumerate(spec.pass_):
        yield from (
            loaded.problem(("pass", index, entry.kind, key), "SC303", f"{entry.kind} can never hold: {why}")
            for key, why in _never_holds(entry, goals, whole, legs, speed, drive)
        )


def _never_holds(
    entry: AnyCriterion, goals: tuple[Goal, ...], whole: list[float], legs: list[float], speed: float, drive: str
) -> Iterator[tuple[str, str]]:
    """The bound's key and why it cannot be kept."""
    criterion, names = entry.chosen, [goal.name for goal in goals]
    bound = getattr(criterion, "max", None)
    if entry.kind == "time_to_goal" and isinstance(bound, float):
        named = getattr(criterion, "goal", None)
        least = (
            sum(legs) if named is None else min((leg for leg, n in zip(legs, names, strict=True) if is_named(n, named)))
        )
        if least / speed > bound:
            yield "max", drive if named is None else f"the way to `{named}` alone takes {least / speed:.1f} s at least"
    if entry.kind == "path_length":
        ratio = getattr(criterion, "max_ratio", None)
        if isinstance(bound, float) and sum(legs) > bound:
            yield "max", f"the shortest way through all goals is {sum(whole):.2f} m long"
        if ratio is not None and sum(legs) > ratio * sum(whole):
            yield "max_ratio", "no way is shorter than the shortest"
    within = getattr(criterion, "within", None)
    if entry.kind == "goals_reached" and within is not None:
        chosen = getattr(criterion, "goals", None) or names
        far = [
            k
            for k, name in enumerate(names)
            if any(is_named(name, each) for each in chosen) and legs[k] / speed > within
        ]
        if far:
            yield "within", f"the way of {whole[far[0]]:.2f} m to `{names[far[0]]}` takes {legs[far[0]] / speed:.1f} s"


def _asks_for_success(entry: AnyCriterion) -> bool:
    """Whether the run fails unless every goal is reached."""
    if entry.kind == "result":
        wants = getattr(entry.chosen, "status", "") == "SUCCEEDED"
    else:
        some = getattr(entry.chosen, "goals", None) or getattr(entry.chosen, "goal", None)
        wants = entry.kind in ("goals_reached", "time_to_goal") and not some
    return wants and entry.severity == "fail"
