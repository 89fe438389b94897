"""Checks for goals without a route, and for bounds on time or path length that no drive to the goals can meet."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Solid
from simscen.core.messages.goals import Goal
from simscen.core.messages.goals import matches_goal_name as is_named
from simscen.criteria.registry import AnyCriterion
from simscen.loading.checks.placement import blocked_poses
from simscen.loading.checks.registry import TIMING, WORLD, CheckProblem
from simscen.loading.checks.route_search import robot_routes
from simscen.loading.checks.scene import START, Scene, expected_failure_hint
from simscen.loading.goals import expects_failure, scenario_goals
from simscen.model.robot import RobotSpec
from simscen.worlds.geometry.overlaps import first_solid_in_disc

GAP_EDGE_M = 0.03
"""Maximum distance of a solid from the side of a gap that the solid forms."""


class Gap(NamedTuple):
    """Narrowest place on the widest way to a goal: its description in messages, and its position (x, y) in m."""

    description: str
    position: tuple[float, float]


def unreachable_goals(scene: Scene) -> list[tuple[CheckProblem, Gap]]:
    """Return a problem for each goal without a route, and the gap that is too narrow."""
    blocked = scene.cached(blocked_poses)
    if START in blocked:
        return []
    routes, starts, world = scene.cached(robot_routes), scene.start_poses, scene.world.solids
    solids = (*world, *scene.immovable_bodies) if scene.immovable_bodies else world
    found = []
    for keys, goal in scene.expected_goals:
        if keys in blocked or routes.is_reachable(starts, goal.pose, solids):
            continue
        gap = _widest_gap(scene, goal.pose, solids)
        message = f"goal `{goal.name}` cannot be reached from the start: {gap.description}"
        if solids is not world and routes.is_reachable(starts, goal.pose, world):
            problem = CheckProblem(keys, message, "no event opens, moves or removes it", is_warning=True)
        elif scene.loaded.may_do():
            hint = "unless an action of an installed package opens a route"
            problem = CheckProblem(keys, message, hint, is_warning=True)
        elif len(scene.certain_walls) < len(world) and routes.is_reachable(starts, goal.pose, scene.certain_walls):
            problem = CheckProblem(keys, message, _ramp_hint(scene), is_warning=True)
        else:
            problem = CheckProblem(keys, message, f"widen the gap, or {expected_failure_hint(keys, 'NO_VALID_PATH')}")
        found.append((problem, gap))
    return found


@WORLD.check("SC302")
def goals_without_route(scene: Scene) -> Iterator[CheckProblem]:
    """Find goals to which no route leads."""
    return (problem for problem, _ in scene.cached(unreachable_goals))


def _ramp_hint(scene: Scene) -> str:
    """Return the hint that a tilted solid on the way could be a ramp, with the maximum slope that the robot climbs."""
    from simscen.loading.builders import load_robot
    from simscen.sim.body.climb_limits import compute_climb_limits

    slope = math.degrees(compute_climb_limits(load_robot(scene.loaded)[1]).slope)
    climbs = f"climbs slopes up to {slope:.1f}°" if slope else "cannot climb slopes"
    return f"unless a tilted solid there is a ramp that the robot can climb; this robot {climbs}"


def _widest_gap(scene: Scene, goal: Pose2, solids: tuple[Solid, ...]) -> Gap:
    """Return the narrowest gap between `solids` on the widest way to the goal."""
    from simscen.worlds.geometry.triangulation import merge_solids
    from simscen.worlds.routes.clearance import clearance_field, search_grid
    from simscen.worlds.routes.narrow_gaps import narrowest_gap

    routes, radius = scene.cached(robot_routes), scene.size.inscribed_radius
    field = clearance_field(merge_solids(solids), search_grid(routes.bounds, radius), routes.z_range)
    gap = narrowest_gap(field, (scene.start, goal), radius)
    position = f"({gap.x:.2f}, {gap.y:.2f})"
    sides = gap.sides or ((gap.x, gap.y), (gap.x, gap.y))
    names = [first_solid_in_disc(solids, side, GAP_EDGE_M, routes.z_range) for side in sides]
    if gap.width <= 0:
        obstacle = f"`{names[0]}`" if names[0] else "a wall"
        return Gap(f"{obstacle} closes the last route at {position}", (gap.x, gap.y))
    between = f" between `{names[0]}` and `{names[1]}`" if names[0] and names[1] else ""
    robot_width = f"the robot is at least {2 * radius:.2f} m wide"
    return Gap(f"the widest gap is {gap.width:.2f} m wide at {position}{between}, but {robot_width}", (gap.x, gap.y))


MIN_PATH_RATIO = 0.97
"""Lower bound on the length of a drive, divided by the computed length of the shortest path, which has an error."""
MAX_AVERAGE_SPEED_RATIO = 1.02
"""Upper bound on the average speed of a drive, divided by the top speed of the robot."""
SHORTCUT_ACTIONS = ("kidnap", "push", "new_goal", "cancel_goal")
"""Kinds of actions because of which the robot may not have to drive the whole way to its goals."""


@dataclass(frozen=True)
class Drive:
    """Drive of the robot to all goals in order. A leg leads from the start or a goal to the next goal."""

    goals: tuple[Goal, ...]
    robot: RobotSpec
    leg_lengths: list[float]
    """Length in m of the shortest path of each leg, or an upper bound on this length."""

    @property
    def min_leg_lengths(self) -> list[float]:
        """Lower bound on the driven length of each leg in m, considering the tolerances of the goals."""
        tolerances = [0.0, *(goal.xy_tolerance for goal in self.goals)]
        pairs = zip(self.leg_lengths, pairwise(tolerances), strict=True)
        return [max(0.0, MIN_PATH_RATIO * length - begin - end) for length, (begin, end) in pairs]

    @property
    def min_leg_times(self) -> list[float]:
        """Lower bound on the time for each leg in s."""
        return [length / (MAX_AVERAGE_SPEED_RATIO * self.robot.top_speed) for length in self.min_leg_lengths]

    @property
    def top_speed_text(self) -> str:
        """Top speed as part of a message."""
        return f"at the robot's top speed of {self.robot.top_speed:g} m/s"

    @property
    def description(self) -> str:
        """Length and time of the whole drive, as part of a message."""
        total = sum(self.leg_lengths)
        time = f"{total / self.robot.top_speed:.1f} s"
        return f"the path of {total:.2f} m to all goals takes {time} {self.top_speed_text}"


@TIMING.check("SC303")
def impossible_time_bounds(scene: Scene) -> Iterator[CheckProblem]:
    """Find timeouts, time limits, and bounds of criteria that no drive can meet."""
    goals, robot = scenario_goals(scene.loaded.spec), scene.loaded.robot.spec
    failing = any(expects_failure(scene.loaded.spec, goal.name) for goal in goals)
    if not goals or robot is None or failing or scene.loaded.may_do(*SHORTCUT_ACTIONS):
        return
    routes, stops = scene.cached(robot_routes), (scene.start, *(goal.pose for goal in goals))
    # The fast search returns upper bounds on the lengths. If these lengths meet all bounds, the exact ones do as well.
    upper = [routes.length_upper_bound(a, b, scene.world.solids) for a, b in pairwise(stops)]
    if all(map(math.isfinite, upper)) and not list(_violated_bounds(scene, Drive(goals, robot, upper))):
        return
    exact = [routes.length(a, b) for a, b in pairwise(stops)]
    if all(map(math.isfinite, exact)):
        yield from _violated_bounds(scene, Drive(goals, robot, exact))


def _violated_bounds(scene: Scene, drive: Drive) -> Iterator[CheckProblem]:
    spec = scene.loaded.spec
    for index, goal in enumerate(drive.goals[: len(spec.goals)]):
        is_sent = index == 0 or spec.on_goal_failure == "stop"
        if goal.timeout is not None and drive.min_leg_times[index] > goal.timeout and is_sent:
            length = drive.leg_lengths[index]
            reason = f"the path of {length:.2f} m takes {length / drive.robot.top_speed:.1f} s {drive.top_speed_text}"
            message = f"goal `{goal.name}` cannot be reached within {goal.timeout:g} s: {reason}"
            yield CheckProblem(("goals", index, "timeout"), message)
    waits = sum(goal.wait for goal in drive.goals)
    if sum(drive.min_leg_times) + waits > spec.time_limit and any(map(_requires_success, spec.pass_)):
        keys = ("time_limit",) if "time_limit" in spec.model_fields_set else ("goals",)
        waiting = f", and the robot waits {waits:g} s at goals" if waits else ""
        message = f"the goals cannot be reached within {spec.time_limit:g} s: {drive.description}{waiting}"
        yield CheckProblem(keys, message)
    for index, entry in enumerate(spec.pass_):
        for key, reason in _violated_criterion_bounds(entry, drive):
            yield CheckProblem(("pass", index, entry.kind, key), f"{entry.kind} can never hold: {reason}")


def _violated_criterion_bounds(entry: AnyCriterion, drive: Drive) -> Iterator[tuple[str, str]]:
    """Yield the key of each bound of a criterion that the drive violates, and the reason for messages."""
    criterion, names = entry.chosen, [goal.name for goal in drive.goals]
    times, lengths = drive.min_leg_times, drive.min_leg_lengths
    if entry.kind == "time_to_goal":
        goal = criterion.goal
        goal_times = (t for t, name in zip(times, names, strict=True) if is_named(name, goal))
        min_time = sum(times) if goal is None else min(goal_times)
        if min_time > criterion.max:
            reason = f"the path to `{goal}` alone takes at least {min_time:.1f} s"
            yield "max", drive.description if goal is None else reason
    if entry.kind == "path_length":
        if criterion.max is not None and sum(lengths) > criterion.max:
            yield "max", f"the shortest path to all goals is {sum(drive.leg_lengths):.2f} m long"
        if criterion.max_ratio is not None and sum(lengths) > criterion.max_ratio * sum(drive.leg_lengths):
            yield "max_ratio", "no path is shorter than the shortest one"
    if entry.kind == "goals_reached" and criterion.within is not None:
        judged_goals = criterion.goals or names
        for name, time, length in zip(names, times, drive.leg_lengths, strict=True):
            if time > criterion.within and any(is_named(name, goal) for goal in judged_goals):
                yield "within", f"the path of {length:.2f} m to `{name}` takes {time:.1f} s"
                return


def _requires_success(entry: AnyCriterion) -> bool:
    """Return whether a criterion fails the run unless all goals are reached."""
    requires = (
        (entry.kind == "result" and entry.chosen.status == "SUCCEEDED")
        or (entry.kind == "goals_reached" and not entry.chosen.goals)
        or (entry.kind == "time_to_goal" and entry.chosen.goal is None)
    )
    return requires and entry.severity == "fail"
