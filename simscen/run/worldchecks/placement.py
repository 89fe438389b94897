"""What would stand in something else: the robot at its start or a goal, and what events put into the world."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, product

from simscen.actions.move import Move
from simscen.actions.pedestrian import Pedestrian
from simscen.actions.robot import Kidnap
from simscen.actions.spawn import Spawn
from simscen.actions.teleport import Teleport
from simscen.core.geometry import Pose2, Pose3
from simscen.core.navigation import Goal
from simscen.core.problems import Problem
from simscen.core.shapes import Solid
from simscen.core.world import Polygon
from simscen.run.worldchecks.expected_failures import expects_start_failure
from simscen.run.worldchecks.scene import CIRCLE_EDGE, SILL, Keys, Scene
from simscen.spec.motions import Motion
from simscen.triggers.time import Time
from simscen.triggers.trigger import Trigger
from simscen.worlds.contain import first_blocking
from simscen.worlds.overlap import placed, polygons_overlap
from simscen.worlds.upright import upright

GOAL_HINT = "move it, or expect the failure with `result: {status: FAILED, error_code: GOAL_OCCUPIED}`"
OUTSIDE_HINT = GOAL_HINT.replace("GOAL_OCCUPIED", "GOAL_OUTSIDE_MAP")
WITHIN = (-0.9, 0.0, 0.9)
"""Shares of a goal's tolerances at which the robot may stand instead."""


def check_placement(scene: Scene) -> list[tuple[Keys, Problem]]:
    """Problems and whose they are: the start, goals that are to be reached, kidnappings, spawns."""
    checks = (_start(scene), _goals(scene), _kidnaps(scene), _spawns(scene), _people(scene))
    return [found for check in checks for found in check]


def _start(scene: Scene) -> Iterator[tuple[Keys, Problem]]:
    solids = (*scene.world.solids, *scene.standing)
    if not expects_start_failure(scene.loaded.spec):
        yield from _told(scene, ("robot", "pose"), "the robot's start", scene.start, solids, "move it to free space")


def _goals(scene: Scene) -> Iterator[tuple[Keys, Problem]]:
    for keys, goal in scene.targets:
        hint = OUTSIDE_HINT if scene.ground.outside(goal.pose) else GOAL_HINT
        found = list(_told(scene, keys, f"goal `{goal.name}`", goal.pose, scene.world.solids, hint))
        if not found or not _fits_nearby(scene, goal):
            yield from found
        place = goal.pose.x, goal.pose.y
        if not found and (thing := first_blocking(scene.lying, place, CIRCLE_EDGE, scene.z_range)):
            message = f"goal `{goal.name}` is where `{thing}` is at first, and nothing says that it will be gone"
            yield keys, replace(scene.loaded.problem(keys, "SC301", message, GOAL_HINT), severity="warning")


def _fits_nearby(scene: Scene, goal: Goal) -> bool:
    """Whether only the exact pose is too tight, for a footprint that is not round: the robot may stop near it."""
    outside = scene.ground.outside(goal.pose)
    if outside or scene.size.radius is not None or scene.circle_at(goal.pose, scene.world.solids):
        return False
    x, y, yaw = goal.pose
    near = (
        Pose2(x + a * goal.xy_tolerance, y + b * goal.xy_tolerance, yaw + c * goal.yaw_tolerance)
        for a, b, c in product(WITHIN, repeat=3)
        if math.hypot(a, b) <= 1
    )
    return any(scene.footprint_at(pose, scene.world.solids) is None for pose in near)


def _kidnaps(scene: Scene) -> Iterator[tuple[Keys, Problem]]:
    for keys, _, action in scene.actions:
        if isinstance(action, Kidnap):
            what, hint = "the place where the robot is set down", "move it to free space"
            yield from _told(scene, (*keys, "pose"), what, action.pose.pose, scene.world.solids, hint)


def _told(
    scene: Scene, keys: Keys, what: str, pose: Pose2, solids: tuple[Solid, ...], hint: str
) -> Iterator[tuple[Keys, Problem]]:
    where = scene.ground.outside(pose) or scene.footprint_at(pose, solids)
    if where:
        yield keys, scene.loaded.problem(keys, "SC301", f"{what} ({pose.x:g}, {pose.y:g}) is {where}", hint)


def _spawns(scene: Scene) -> Iterator[tuple[Keys, Problem]]:
    for keys, _, action in scene.actions:
        if isinstance(action, Spawn):
            first = keys[2] == "do"  # a step of a story comes later, and its time counts from the one before it
            when = scene.loaded.spec.events[int(keys[1])].when if first else None
            where = _buried(scene, action) or _on_the_robot(scene, action, when)
            if where:
                message, hint = f"`{action.name}` would appear {where}", "put it somewhere else"
                yield keys, scene.loaded.problem((*keys, "name"), "SC304", message, hint)


def _people(scene: Scene) -> Iterator[tuple[Keys, Problem]]:
    """People who would stand, or want to go, where a wall or an obstacle leaves no room for them."""
    solids = (*scene.world.solids, *scene.staying)
    for keys, _, action in scene.actions:
        if not isinstance(action, Pedestrian):
            continue
        stops: list[tuple[Keys, str, tuple[float, float]]]
        stops = [
            ((*keys, "goals", k), f"goal {k + 1} of `{action.name}`", (x, y)) for k, (x, y) in enumerate(action.goals)
        ]
        stops.insert(0, ((*keys, "pose"), f"where `{action.name}` comes", (action.pose.x, action.pose.y)))
        for at, what, place in stops:
            if solid := first_blocking(solids, place, action.radius, (SILL, action.height)):
                message = (
                    f'{what} ({place[0]:g}, {place[1]:g}) is nearer to obstacle "{solid}" than {action.radius:g} m'
                )
                yield at, scene.loaded.problem(at, "SC304", message, "put it where a person has room")


def _buried(scene: Scene, spawn: Spawn) -> str | None:
    """Where a thing is put whose whole outline lies within one obstacle: nobody would ever meet it."""
    if spawn.pose is None:
        return None
    corners = placed(_outline(spawn), spawn.pose.pose)
    for solid in scene.world.solids:
        prism = upright(solid)
        if prism is None or prism.bottom > spawn.z or prism.top < spawn.z + spawn.tall:
            continue
        if all(prism.distance(corner, (prism.bottom, prism.top)) == 0 for corner in corners):
            return f'inside obstacle "{solid.name}"'
    return None


def _on_the_robot(scene: Scene, spawn: Spawn, when: Trigger | None) -> str | None:
    """Whether a thing is put where the robot is at that moment: beside it at any time, or at its start at once."""
    if spawn.z >= scene.size.height:
        return None
    if spawn.ahead is not None:
        corners = placed(_outline(spawn), Pose2(spawn.ahead[0], spawn.ahead[1], spawn.yaw))
    elif spawn.pose is not None and when and isinstance(when.time, Time) and when.time.root + when.delay == 0:
        corners = placed(_outline(spawn), scene.start.inverse().compose(spawn.pose.pose))
    else:
        return None
    return "on the robot" if polygons_overlap(scene.outline, corners) else None


def _outline(spawn: Spawn) -> Polygon:
    """Of a thing in its own frame; corner for corner that of its convex hull when it is not convex."""
    solid = spawn.solid(spawn.name)
    prism = upright(Solid(solid.shape, Pose3(z=solid.pose.z), spawn.name))
    return prism.base if prism is not None else tuple((x, y) for x, y in spawn.polygon or ())


# MERGED: Where scripts would lead things: into walls, where nobody meets them.
Stop = tuple[Keys, str, tuple[float, float]]


def check_motions(scene: Scene) -> Iterator[Problem]:
    """Warnings about keyframes, waypoints and new places of things that lie within the fixed world."""
    for keys, _, action in scene.actions:
        stops: list[Stop] = []
        if isinstance(action, Move):
            stops = [
                ((*keys, *below), f"{what} of `{action.name}`", place) for below, what, place in motion_stops(action)
            ]
        elif isinstance(action, Teleport):
            stops = [((*keys, "pose"), f"the new place of `{action.name}`", (action.pose.x, action.pose.y))]
        for at, what, (x, y) in stops:
            if solid := first_blocking(scene.world.solids, (x, y), CIRCLE_EDGE, scene.z_range):
                message = f'{what} ({x:g}, {y:g}) is inside obstacle "{solid}"'
                problem = scene.loaded.problem(
                    at, "SC304", message, "put it where it can be met: nothing stops what a script moves"
                )
                yield replace(problem, severity="warning")


def motion_stops(motion: Motion) -> list[Stop]:
    """The keyframes or waypoints of a motion: keys below its own, what each is, and where."""
    if motion.keyframes is not None:
        return [(("keyframes", k), f"keyframe {k + 1}", (x, y)) for k, (_, x, y, _) in enumerate(motion.keyframes)]
    return [(("through", k), f"waypoint {k + 1}", (x, y)) for k, (x, y) in enumerate(motion.through or [])]


# MERGED: Whether several robots start apart from each other.
def check_robots_apart(scenes: Sequence[Scene]) -> Iterator[Problem]:
    """An error for each robot that starts where another one does, told of the later by name."""
    for one, other in combinations(scenes, 2):
        if polygons_overlap(placed(one.outline, one.start), placed(other.outline, other.start)):
            names = f"`{other.loaded.robot_name}` starts in the same place as `{one.loaded.robot_name}`"
            where = f"({other.start.x:g}, {other.start.y:g}) and ({one.start.x:g}, {one.start.y:g})"
            hint = "move one of them by more than the size of both"
            yield other.loaded.problem(("robot", "pose"), "SC044", f"robot {names}: {where}", hint)
