"""What only geometry can tell about a scenario before it runs: is the start free, can a goal be reached at all?

Needs no engine, and for own worlds of simple shapes not even numpy.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from simscen.core.problems import Problem
from simscen.core.world import World
from simscen.loading.consistency import inconsistencies
from simscen.loading.loaded import LoadedScenario, LoadedWorld
from simscen.run.masks import load_masks
from simscen.run.precheck.apart import apart
from simscen.run.precheck.judgedmasks import judged_by_masks
from simscen.run.precheck.masked import masked
from simscen.run.precheck.misplaced import misplaced
from simscen.run.precheck.pointless import places_of_triggers, pointless
from simscen.run.precheck.routes import in_walls
from simscen.run.precheck.scene import Scene
from simscen.run.precheck.sketch import draw
from simscen.run.precheck.unreachable import starts_of, unreachable
from simscen.run.precheck.untimely import untimely
from simscen.run.precheck.ways import Ways
from simscen.run.precheck.worldchecks import misnamed
from simscen.run.robotsize import robot_size_of
from simscen.run.robotways import as_met
from simscen.run.worldcache import WorldCache
from simscen.run.worldsource import load_robot
from simscen.worlds.mapsize import too_large


def check(loaded: LoadedScenario, cache: WorldCache | None = None, pictures: Path | None = None) -> list[Problem]:
    """What cannot be, at the line it is written in, and what deserves a look, as warnings.

    `cache` keeps worlds for the scenarios to come; into the folder `pictures` goes a picture of what is wrong. Raises
    InvalidInput for unusable files, and UsageError for a picture that cannot be written.
    """
    cache = cache or WorldCache()
    if not loaded.robots:
        return _checked(loaded, cache, pictures)
    found = [problem for view in loaded.robots.values() for problem in _checked(view, cache, pictures)]
    problems = list(dict.fromkeys(found))  # what is wrong with all of them is told once
    if not _has_errors(problems):
        world, views = cache.world(loaded), [_with_robot(view) for view in loaded.robots.values()]
        problems += apart([Scene(view, world, robot_size_of(view)) for view in views])
    return problems


def _checked(loaded: LoadedScenario, cache: WorldCache, pictures: Path | None) -> list[Problem]:
    """Of a scenario of one robot, or as one of several sees it."""
    world = cache.world(loaded)
    loaded = _with_robot(loaded)
    met = as_met(loaded, world)
    problems = [*_once_known(loaded, world), *_too_large(loaded, world)]
    problems += [loaded.sourced(problem) for problem in misnamed(met, loaded.world)]
    problems += _otherwise(loaded)
    if not _has_errors(problems):
        problems += _impossible(Scene(loaded, met, robot_size_of(loaded)), cache, pictures)
    return [*problems, *notes_of(world, loaded.world, loaded.root)]


def _impossible(scene: Scene, cache: WorldCache, pictures: Path | None) -> list[Problem]:
    stops = (*starts_of(scene), *(goal.pose for _, goal in scene.targets), *places_of_triggers(scene))
    ways = Ways(scene, cache, stops)
    wrong = misplaced(scene)
    closed = list(unreachable(scene, ways, {keys for keys, _ in wrong}))
    problems = [*(problem for _, problem in wrong), *(problem for problem, _ in closed)]
    problems += [] if any(keys == ("robot", "pose") for keys, _ in wrong) else pointless(scene, ways)
    problems += in_walls(scene)
    problems += judged_by_masks(scene)
    problems += masked(scene, load_masks(scene.loaded))
    problems += [] if _has_errors(problems) else untimely(scene, ways)
    if problems and pictures is not None:
        file = draw(scene, [gap for _, gap in closed], pictures)
        problems = [replace(problem, hint=f"{problem.hint}; picture: {file}".lstrip("; ")) for problem in problems]
    return problems


def _otherwise(loaded: LoadedScenario) -> Iterator[Problem]:
    """Where a robot's file and its URDF do not agree."""
    if loaded.robot.urdf is None:
        return
    from simscen.run.robotgeometry import otherwise

    yield from map(loaded.sourced, otherwise(loaded.robot, load_robot(loaded)[1]))


def _has_errors(problems: list[Problem]) -> bool:
    return any(problem.severity == "error" for problem in problems)


def _with_robot(loaded: LoadedScenario) -> LoadedScenario:
    """The scenario with what is plain from its robot's URDF."""
    if loaded.robot.spec is not None:
        return loaded
    return replace(loaded, robot=replace(loaded.robot, spec=load_robot(loaded)[0]))


def _once_known(loaded: LoadedScenario, world: World) -> list[Problem]:
    """What the text alone could not tell: the names of an imported world, the sensors of a bare URDF."""
    bare = loaded.robot.path == loaded.robot.urdf
    if bare or loaded.world.map is not None or loaded.world.sdf is not None:
        return sorted(inconsistencies(loaded, world))
    return []


def notes_of(world: World, source: LoadedWorld, root: Path) -> list[Problem]:
    """What the readers of a world had to say, as warnings about its file."""
    shown = source.path.relative_to(root).as_posix() if source.path.is_relative_to(root) else str(source.path)
    return [Problem(shown, 0, 0, "SC311", note.removeprefix(f"{shown}: "), severity="warning") for note in world.notes]


def _too_large(loaded: LoadedScenario, world: World) -> Iterator[Problem]:
    message = too_large(world.bounds) if world.grid is None else None
    if message:
        yield loaded.problem(("world",), "SC330", message, "is something placed far away from the rest?")
