"""Where scripts would lead things: into walls, where nobody meets them."""

from collections.abc import Iterator
from dataclasses import replace

from simscen.actions.move import Move
from simscen.actions.teleport import Teleport
from simscen.core.problems import Problem
from simscen.run.precheck.scene import CIRCLE_EDGE, Keys, Scene
from simscen.spec.motions import Motion
from simscen.worlds.contain import first_blocking

Stop = tuple[Keys, str, tuple[float, float]]


def in_walls(scene: Scene) -> Iterator[Problem]:
    """Warnings about keyframes, waypoints and new places of things that lie within the fixed world."""
    for keys, _, action in scene.actions:
        stops: list[Stop] = []
        if isinstance(action, Move):
            stops = [((*keys, *below), f"{what} of `{action.name}`", place) for below, what, place in stops_of(action)]
        elif isinstance(action, Teleport):
            stops = [((*keys, "pose"), f"the new place of `{action.name}`", (action.pose.x, action.pose.y))]
        for at, what, (x, y) in stops:
            if solid := first_blocking(scene.world.solids, (x, y), CIRCLE_EDGE, scene.z_range):
                message = f'{what} ({x:g}, {y:g}) is inside obstacle "{solid}"'
                problem = scene.loaded.problem(
                    at, "SC304", message, "put it where it can be met: nothing stops what a script moves"
                )
                yield replace(problem, severity="warning")


def stops_of(motion: Motion) -> list[Stop]:
    """The keyframes or waypoints of a motion: keys below its own, what each is, and where."""
    if motion.keyframes is not None:
        return [(("keyframes", k), f"keyframe {k + 1}", (x, y)) for k, (_, x, y, _) in enumerate(motion.keyframes)]
    return [(("through", k), f"waypoint {k + 1}", (x, y)) for k, (x, y) in enumerate(motion.through or [])]
