"""Goals that no way leads to: a sealed room, or a gap that is narrower than the robot."""

import math
from collections.abc import Iterator
from dataclasses import replace

from simscen.actions.robot import Kidnap
from simscen.core.geometry import Pose2
from simscen.core.problems import Problem
from simscen.core.shapes import Solid
from simscen.run.worldchecks.routes import RobotRoutes
from simscen.run.worldchecks.scene import Keys, Scene
from simscen.worlds.contain import first_blocking

HINT = "open a way, or expect the failure with `result: {status: FAILED, error_code: NO_VALID_PATH}`"
BESIDE = 0.03
"""Metres around the edge of a gap in which the solid is that makes it."""


def start_poses(scene: Scene) -> list[Pose2]:
    """Where the robot may come from: its start, and wherever an event sets it down."""
    return [scene.start, *(action.pose.pose for _, _, action in scene.actions if isinstance(action, Kidnap))]


def check_reachability(
    scene: Scene, ways: RobotRoutes, misplaced: set[Keys]
) -> Iterator[tuple[Problem, tuple[float, float]]]:
    """A problem for each goal that is cut off, and where; those that are misplaced have theirs already.

    It is an error when fixed walls cut it off, and a warning when something does that might be passed or moved.
    """
    if ("robot", "pose") in misplaced:
        return
    starts, world = start_poses(scene), scene.world.solids
    for keys, goal in scene.targets:
        closed = (*world, *scene.staying) if scene.staying else world
        if keys in misplaced or ways.lead(starts, goal.pose, closed):
            continue
        where, place = _cut_off(scene, ways, goal.pose, closed)
        what = f"goal `{goal.name}` cannot be reached from the start: {where}"
        if closed is not world and ways.lead(starts, goal.pose, world):
            problem = scene.loaded.problem(keys, "SC302", what, "nothing in the scenario opens, moves or removes it")
            yield replace(problem, severity="warning"), place
        elif scene.does():
            problem = scene.loaded.problem(keys, "SC302", what, "unless an action of an installed package opens a way")
            yield replace(problem, severity="warning"), place
        elif len(scene.certain) < len(world) and ways.lead(starts, goal.pose, scene.certain):
            problem = scene.loaded.problem(keys, "SC302", what, _slopes(scene))
            yield replace(problem, severity="warning"), place
        else:
            yield scene.loaded.problem(keys, "SC302", what, HINT), place


def _slopes(scene: Scene) -> str:
    """When a way may be open all the same: what is not upright may be a ramp."""
    from simscen.run.worldsource import load_robot
    from simscen.sim.climb import climb_of

    slope = math.degrees(climb_of(load_robot(scene.loaded)[1]).slope)
    climbs = f"climbs {slope:.1f}° without a run-up" if slope else "stays on the floor"
    return f"unless what is not upright there is a ramp that it gets up; this robot {climbs}"


def _cut_off(
    scene: Scene, ways: RobotRoutes, goal: Pose2, solids: tuple[Solid, ...]
) -> tuple[str, tuple[float, float]]:
    """Where the widest way is too narrow, in words and as a place."""
    from simscen.worlds.meshing import fuse
    from simscen.worlds.narrowest import narrowest

    gap = narrowest(fuse(solids), ways.bounds, (scene.start, goal), scene.size.inscribed, ways.z_range)
    place = f"({gap.x:.2f}, {gap.y:.2f})"
    names = [
        first_blocking(solids, side, BESIDE, ways.z_range) for side in (gap.sides or ((gap.x, gap.y), (gap.x, gap.y)))
    ]
    if gap.width <= 0:
        by = f"`{names[0]}` at {place}" if names[0] else f"a wall at {place}"
        return f"{by} closes the last way", (gap.x, gap.y)
    between = f" between `{names[0]}` and `{names[1]}`" if names[0] and names[1] else ""
    return (
        f"the widest way there is {gap.width:.2f} m wide at {place}{between}, "
        f"but the robot is at least {2 * scene.size.inscribed:.2f} m wide"
    ), (gap.x, gap.y)
