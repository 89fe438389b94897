"""What only geometry can tell about a scenario before it runs: is the start free, can a goal be reached at all?

Needs no engine, and for own worlds of simple shapes not even numpy.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from simscen.core.errors import UsageError
from simscen.core.outputs import require_plain
from simscen.core.problems import Problem
from simscen.core.world import World
from simscen.loading.checks.runner import check_scenario
from simscen.loading.loaded import LoadedScenario, LoadedWorld
from simscen.run.masks import load_masks
from simscen.run.robotsize import robot_size_of
from simscen.run.robotways import as_met
from simscen.run.worldcache import WorldCache
from simscen.run.worldchecks.masks import check_judged_masks, check_stack_zones
from simscen.run.worldchecks.placement import check_motions, check_placement, check_robots_apart
from simscen.run.worldchecks.reachability import check_reachability, start_poses
from simscen.run.worldchecks.regions import check_regions, trigger_positions
from simscen.run.worldchecks.routes import RobotRoutes
from simscen.run.worldchecks.scene import Scene
from simscen.run.worldchecks.timing import check_time_bounds
from simscen.run.worldchecks.world_file import check_world_places
from simscen.run.worldsource import load_robot
from simscen.worlds.mapsize import too_large
from simscen.worlds.overlap import placed


def check_in_world(
    loaded: LoadedScenario, cache: WorldCache | None = None, pictures: Path | None = None
) -> list[Problem]:
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
        problems += check_robots_apart([Scene(view, world, robot_size_of(view)) for view in views])
    return problems


def _checked(loaded: LoadedScenario, cache: WorldCache, pictures: Path | None) -> list[Problem]:
    """Of a scenario of one robot, or as one of several sees it."""
    world = cache.world(loaded)
    loaded = _with_robot(loaded)
    met = as_met(loaded, world)
    problems = [*_once_known(loaded, world), *_too_large(loaded, world)]
    problems += [loaded.sourced(problem) for problem in check_world_places(met, loaded.world)]
    problems += _otherwise(loaded)
    if not _has_errors(problems):
        problems += _impossible(Scene(loaded, met, robot_size_of(loaded)), cache, pictures)
    return [*problems, *world_reader_notes(world, loaded.world, loaded.root)]


def _impossible(scene: Scene, cache: WorldCache, pictures: Path | None) -> list[Problem]:
    stops = (*start_poses(scene), *(goal.pose for _, goal in scene.targets), *trigger_positions(scene))
    ways = RobotRoutes(scene, cache, stops)
    wrong = check_placement(scene)
    closed = list(check_reachability(scene, ways, {keys for keys, _ in wrong}))
    problems = [*(problem for _, problem in wrong), *(problem for problem, _ in closed)]
    problems += [] if any(keys == ("robot", "pose") for keys, _ in wrong) else check_regions(scene, ways)
    problems += check_motions(scene)
    problems += check_judged_masks(scene)
    problems += check_stack_zones(scene, load_masks(scene.loaded))
    problems += [] if _has_errors(problems) else check_time_bounds(scene, ways)
    if problems and pictures is not None:
        file = draw_picture(scene, [gap for _, gap in closed], pictures)
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
        return sorted(check_scenario(loaded, world))
    return []


def world_reader_notes(world: World, source: LoadedWorld, root: Path) -> list[Problem]:
    """What the readers of a world had to say, as warnings about its file."""
    shown = source.path.relative_to(root).as_posix() if source.path.is_relative_to(root) else str(source.path)
    return [Problem(shown, 0, 0, "SC311", note.removeprefix(f"{shown}: "), severity="warning") for note in world.notes]


def _too_large(loaded: LoadedScenario, world: World) -> Iterator[Problem]:
    message = too_large(world.bounds) if world.grid is None else None
    if message:
        yield loaded.problem(("world",), "SC330", message, "is something placed far away from the rest?")


# MERGED: A picture of what `validate` refuses: the world, the robot at its start and its goals, and the gap that is closed.
def draw_picture(scene: Scene, gaps: Sequence[tuple[float, float]], folder: Path) -> Path:
    """Write `<folder>/<id>.png`, and say where. Raises UsageError when it cannot be written."""
    from simscen.worlds.build import build
    from simscen.worlds.picture import picture

    low, high = scene.z_range
    height = (low + high) / 2
    poses = [scene.start, *(goal.pose for _, goal in scene.targets)]
    image = picture(build(scene.world, height), height, [placed(scene.outline, pose) for pose in poses], gaps)
    file = folder / f"{scene.loaded.title}.png"
    try:
        require_plain(file)
        file.parent.mkdir(parents=True, exist_ok=True)
        image.save(file)
    except OSError as error:
        raise UsageError(f"cannot write the picture {file}: {error.strerror}") from error
    return file
