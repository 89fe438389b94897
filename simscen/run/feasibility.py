"""What only geometry can tell about a scenario before it runs: is the start free, can a goal be reached at all?

Needs no engine, and for own worlds of simple shapes not even numpy.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.grid import OccupancyGrid
from simscen.core.problems import Problem
from simscen.core.shapes import Body, Solid
from simscen.core.world import World
from simscen.loading.consistency import inconsistencies
from simscen.loading.loaded import LoadedScenario, LoadedWorld
from simscen.model.scenario import ScenarioSpec
from simscen.run.expectation import expects_bad_start, expects_failure
from simscen.run.goals import goals_of, pose_of, sent_goals
from simscen.run.robotsize import inscribed_radius_of
from simscen.run.worldsource import load_map, load_robot, load_world
from simscen.worlds.contain import first_blocking
from simscen.worlds.mapsize import too_large

HEIGHTS = 0.02, 0.4
"""Heights between which something is in a robot's way; the floor and door sills are below."""


def check(loaded: LoadedScenario) -> list[Problem]:
    """Every start and goal that cannot be, at the line it is written in, and what its world notes, as warnings.

    Raises InvalidInput for unusable files.
    """
    world = load_world(loaded)
    if contradictions := _once_known(loaded, world):
        return contradictions
    radius = inscribed_radius_of(loaded)
    ground = _ground(loaded, world)
    misplaced = [
        loaded.problem(keys, "SC301", f"{what} ({pose.x:g}, {pose.y:g}) is {where}", hint)
        for keys, what, pose, hint in _poses(loaded.spec, world)
        if (where := ground.outside(pose) or _in_the_way(world, pose, radius, at_start=keys[0] == "robot"))
    ]
    return [*_too_large(loaded, world), *misplaced, *notes_of(world, loaded.world, loaded.root)]


def _once_known(loaded: LoadedScenario, world: World) -> list[Problem]:
    """What the text alone could not tell: the names of an imported world, the sensors of a bare URDF."""
    imported = loaded.world.map is not None or loaded.world.sdf is not None
    if loaded.robot.spec is None:
        loaded = replace(loaded, robot=replace(loaded.robot, spec=load_robot(loaded)[0]))
    elif not imported:
        return []
    return sorted(inconsistencies(loaded, world))


def notes_of(world: World, source: LoadedWorld, root: Path) -> list[Problem]:
    """What the readers of a world had to say, as warnings about its file."""
    shown = source.path.relative_to(root).as_posix() if source.path.is_relative_to(root) else str(source.path)
    return [Problem(shown, 0, 0, "SC311", note.removeprefix(f"{shown}: "), severity="warning") for note in world.notes]


def _too_large(loaded: LoadedScenario, world: World) -> Iterator[Problem]:
    message = too_large(world.bounds) if world.grid is None else None
    if message:
        yield loaded.problem(("world",), "SC330", message, "is something placed far away from the rest?")


def _poses(spec: ScenarioSpec, world: World) -> Iterator[tuple[tuple[str | int, ...], str, Pose2, str]]:
    if not expects_bad_start(spec):
        yield ("robot", "pose"), "the robot's start", pose_of(spec.robot.pose, world), "move it to free space"
    own = {("goals", index): goal for index, goal in enumerate(goals_of(spec, world))}
    hint = "move it, or expect the failure with `result: {status: FAILED, error_code: GOAL_OCCUPIED}`"
    for keys, goal in [*own.items(), *sent_goals(spec).items()]:
        if not expects_failure(spec, goal.name):
            yield (*keys, "pose"), f"goal `{goal.name}`", goal.pose, hint


def _ground(loaded: LoadedScenario, world: World) -> "_Ground":
    """Where the robot can be: on the map that it gets, which for a world without one covers all that is in it."""
    if loaded.map == "none":
        return _Ground()
    grid = world.grid if loaded.map is None else load_map(loaded.map)
    return _Ground(world.bounds if grid is None else None, grid)


@dataclass(frozen=True)
class _Ground:
    """Without a map the ground goes on beyond the obstacles: BARN's goals lie there."""

    bounds: tuple[float, float, float, float] | None = None
    grid: OccupancyGrid | None = None

    def outside(self, pose: Pose2) -> str | None:
        if self.grid is not None and not self.grid.inside(self.grid.cell_of(np.array([[pose.x, pose.y]])))[0]:
            rows, columns = self.grid.shape
            size = f"{columns * self.grid.resolution:g} m x {rows * self.grid.resolution:g} m"
            return f"outside the map ({size} from ({self.grid.origin.x:g}, {self.grid.origin.y:g}))"
        if self.bounds is None:
            return None
        left, bottom, right, top = self.bounds
        if left <= pose.x <= right and bottom <= pose.y <= top:
            return None
        return f"outside the world ({left:g} … {right:g}, {bottom:g} … {top:g})"


def _in_the_way(world: World, pose: Pose2, radius: float, at_start: bool) -> str | None:
    """What a robot there would be inside of; what can move counts at the start only, for it may be gone later."""
    solids = (*world.solids, *(_standing(world.bodies) if at_start else ()))
    if solid := first_blocking(solids, (pose.x, pose.y), 1e-6, HEIGHTS):
        return f'inside obstacle "{solid}"'
    solid = first_blocking(solids, (pose.x, pose.y), radius, HEIGHTS)
    return f'nearer to obstacle "{solid}" than the robot\'s radius of {radius:.2f} m' if solid else None


def _standing(bodies: Iterable[Body]) -> Iterator[Solid]:
    """What can move, where it is at first, by the names that scenarios know."""
    for body in bodies:
        for solid in body.solids:
            yield Solid(solid.shape, body.pose.compose(solid.pose), body.name)
