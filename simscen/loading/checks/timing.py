"""Checks of bounds that no drive can meet: no robot exceeds its top speed, and no path is shorter than the shortest."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from simscen.core.messages.navigation import Goal
from simscen.core.messages.navigation import matches_goal_name as is_named
from simscen.criteria.registry import AnyCriterion
from simscen.loading.checks.regions import robot_routes
from simscen.loading.checks.registry import Finding
from simscen.loading.checks.scene import TIMING, Scene, expects_failure
from simscen.loading.goals import scenario_goals
from simscen.model.robot import RobotSpec

MIN_PATH_SHARE = 0.97
"""Factor from the computed shortest path to a length that no drive falls below.

Computed lengths are exact to 1 %, and a robot can cut corners a little more than they assume.
"""
MAX_AVERAGE_SPEED_RATIO = 1.02
"""Largest average speed of a drive, relative to the top speed of the robot."""
SHORTCUT_ACTIONS = ("kidnap", "push", "new_goal", "cancel_goal")
"""Actions after which a robot may be somewhere else, faster, or done earlier."""


@dataclass(frozen=True)
class Drive:
    """A drive of `robot` to all `goals`.

    `lengths` are the lengths in m of the shortest path of each leg, from one goal (or the start) to the next goal.
    """

    goals: tuple[Goal, ...]
    robot: RobotSpec
    lengths: list[float]

    @property
    def least_lengths(self) -> list[float]:
        """Lower bounds of the lengths, given the tolerances of the goals."""
        slack = [0.0, *(goal.xy_tolerance for goal in self.goals)]
        pairs = zip(self.lengths, pairwise(slack), strict=True)
        return [max(0.0, MIN_PATH_SHARE * length - a - b) for length, (a, b) in pairs]

    @property
    def least_times(self) -> list[float]:
        """Lower bound of the time for each leg in s."""
        return [length / (MAX_AVERAGE_SPEED_RATIO * self.robot.top_speed) for length in self.least_lengths]

    @property
    def top_speed_text(self) -> str:
        """The top speed as part of a message."""
        return f"at the robot's top speed of {self.robot.top_speed:g} m/s"

    @property
    def description(self) -> str:
        """Length and time of the whole drive, in words."""
        total = sum(self.lengths)
        return (
            f"the path of {total:.2f} m to all goals takes {total / self.robot.top_speed:.1f} s {self.top_speed_text}"
        )


@TIMING.check("SC303")
def impossible_time_bounds(scene: Scene) -> Iterator[Finding]:
    """Find timeouts, time limits and bounds of criteria that no drive can meet."""
    goals, robot = scenario_goals(scene.loaded.spec), scene.loaded.robot.spec
    failing = any(expects_failure(scene.loaded.spec, goal.name) for goal in goals)
    if not goals or robot is None or failing or scene.may_do(*SHORTCUT_ACTIONS):
        return
    routes, stops = scene.cached(robot_routes), (scene.start, *(goal.pose for goal in goals))
    # The upper bounds are cheap: if the drive meets all bounds with them, it does with the exact lengths.
    upper = [routes.length_upper_bound(a, b) for a, b in pairwise(stops)]
    if all(map(math.isfinite, upper)) and not list(_violated_bounds(scene, Drive(goals, robot, upper))):
        return
    exact = [routes.length(a, b) for a, b in pairwise(stops)]
    if all(map(math.isfinite, exact)):
        yield from _violated_bounds(scene, Drive(goals, robot, exact))


def _violated_bounds(scene: Scene, drive: Drive) -> Iterator[Finding]:
    spec = scene.loaded.spec
    for index, goal in enumerate(drive.goals[: len(spec.goals)]):
        is_sent = index == 0 or spec.on_goal_failure == "stop"
        if goal.timeout is not None and drive.least_times[index] > goal.timeout and is_sent:
            length = drive.lengths[index]
            reason = f"the path of {length:.2f} m takes {length / drive.robot.top_speed:.1f} s {drive.top_speed_text}"
            message = f"goal `{goal.name}` cannot be reached within {goal.timeout:g} s: {reason}"
            yield Finding(("goals", index, "timeout"), message)
    waits = sum(goal.wait for goal in drive.goals)
    if sum(drive.least_times) + waits > spec.time_limit and any(map(_requires_success, spec.pass_)):
        keys = ("time_limit",) if "time_limit" in spec.model_fields_set else ("goals",)
        waiting = f", and the robot waits {waits:g} s at goals" if waits else ""
        message = f"the goals cannot be reached within {spec.time_limit:g} s: {drive.description}{waiting}"
        yield Finding(keys, message)
    for index, entry in enumerate(spec.pass_):
        for key, reason in _violated_criterion_bounds(entry, drive):
            yield Finding(("pass", index, entry.kind, key), f"{entry.kind} can never hold: {reason}")


def _violated_criterion_bounds(entry: AnyCriterion, drive: Drive) -> Iterator[tuple[str, str]]:
    """Yield the key of each bound that cannot be met, and the reason."""
    criterion, names = entry.chosen, [goal.name for goal in drive.goals]
    times, lengths = drive.least_times, drive.least_lengths
    bound = getattr(criterion, "max", None)
    if entry.kind == "time_to_goal" and isinstance(bound, float):
        goal = getattr(criterion, "goal", None)
        least = sum(times) if goal is None else min(t for t, n in zip(times, names, strict=True) if is_named(n, goal))
        if least > bound:
            reason = f"the path to `{goal}` alone takes at least {least:.1f} s"
            yield "max", drive.description if goal is None else reason
    if entry.kind == "path_length":
        ratio = getattr(criterion, "max_ratio", None)
        if isinstance(bound, float) and sum(lengths) > bound:
            yield "max", f"the shortest path to all goals is {sum(drive.lengths):.2f} m long"
        if ratio is not None and sum(lengths) > ratio * sum(drive.lengths):
            yield "max_ratio", "no path is shorter than the shortest one"
    within = getattr(criterion, "within", None)
    if entry.kind == "goals_reached" and within is not None:
        chosen = getattr(criterion, "goals", None) or names
        too_late = [k for k, name in enumerate(names) if times[k] > within and any(is_named(name, c) for c in chosen)]
        if too_late:
            k = too_late[0]
            yield "within", f"the path of {drive.lengths[k]:.2f} m to `{names[k]}` takes {times[k]:.1f} s"


def _requires_success(entry: AnyCriterion) -> bool:
    """Return whether the run fails unless every goal is reached."""
    if entry.kind == "result":
        requires = getattr(entry.chosen, "status", "") == "SUCCEEDED"
    else:
        selected_goals = getattr(entry.chosen, "goals", None) or getattr(entry.chosen, "goal", None)
        requires = entry.kind in ("goals_reached", "time_to_goal") and not selected_goals
    return requires and entry.severity == "fail"
