"""Runs the checks that need the built world: the stages BUILT_WORLD, WORLD, and TIMING."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput, Problem, UsageError
from simscen.core.files import require_not_input, require_regular_file
from simscen.core.geometry.polygons import transform_polygon
from simscen.loading.builders import load_robot, with_stops_in_bounds, world_from_file
from simscen.loading.checks import masks, placement, regions, routes
from simscen.loading.checks.built_world import check_built_world
from simscen.loading.checks.registry import TIMING, WORLD
from simscen.loading.checks.runner import check_scenario
from simscen.loading.checks.scene import Scene
from simscen.loading.files.paths import path_in_messages
from simscen.loading.loaded import LoadedMap, LoadedScenario, LoadedWorld
from simscen.loading.robot_size import blocking_world, robot_size
from simscen.loading.world_cache import WorldCache
from simscen.worlds.extent import oversize_hint
from simscen.worlds.maps.map_size import map_size_error

MODULES = (masks, placement, routes, regions)
"""Modules that register checks when they are imported."""


def check_in_world(
    loaded: LoadedScenario, cache: WorldCache | None = None, picture_folder: Path | None = None
) -> list[Problem]:
    """Return the errors and warnings of a scenario in its built world.

    `cache` keeps built worlds for further calls. If there are problems, a picture of the world is written to the
    folder `picture_folder`, unless it is None. Raises InvalidInput for unusable files, and UsageError if the picture
    cannot be written.
    """
    cache = cache or WorldCache()
    world = with_stops_in_bounds(cache.world(loaded), loaded)
    if not loaded.robots:
        return _check_robot(loaded, world, cache, picture_folder)
    found = [problem for view in loaded.robots.values() for problem in _check_robot(view, world, cache, picture_folder)]
    problems = list(dict.fromkeys(found))  # the robots share most problems
    if not _has_errors(problems):
        views = [_with_robot_spec(view) for view in loaded.robots.values()]
        scenes = [Scene(view, world, robot_size(view), cache) for view in views]
        problems += placement.overlapping_start_problems(scenes)
    return problems


def world_problems(
    loaded: LoadedScenario, cache: WorldCache | None = None, picture_folder: Path | None = None
) -> list[Problem]:
    """Return the problems of `check_in_world`; for unusable files, the problems of InvalidInput."""
    try:
        return check_in_world(loaded, cache, picture_folder)
    except InvalidInput as error:
        return error.problems


def _check_robot(loaded: LoadedScenario, world: World, cache: WorldCache, picture_folder: Path | None) -> list[Problem]:
    loaded = _with_robot_spec(loaded)
    blocking = blocking_world(loaded, world)
    problems: list[Problem] = []
    is_urdf = loaded.robot.path == loaded.robot.urdf
    if is_urdf or loaded.world.map is not None or loaded.world.sdf is not None:
        problems += sorted(check_scenario(loaded, world))  # the names in these files were not known before
    if world.grid is None and loaded.map is None and (message := map_size_error(world.bounds)):
        hint = f"{oversize_hint(world)}, or drive with `map: none`"
        problems.append(loaded.problem(("world",), "SC330", message, hint))
    file_problems = check_built_world(blocking, loaded.world)
    if loaded.robot.urdf is not None:
        from simscen.loading.checks.robot_geometry import dimension_warnings

        file_problems += dimension_warnings(loaded.robot, load_robot(loaded)[1])
    problems += [loaded.with_source_line(problem) for problem in file_problems]
    if not _has_errors(problems):
        problems += _check_scene(Scene(loaded, blocking, robot_size(loaded), cache), picture_folder)
    return [*problems, *world_reader_notes(world, loaded.world, loaded.root)]


def _check_scene(scene: Scene, picture_folder: Path | None) -> list[Problem]:
    """Return the problems that the stages WORLD and TIMING find. Their hints contain the path of a picture."""
    problems = WORLD.problems(scene.loaded.tree, scene)
    if not _has_errors(problems):
        problems += TIMING.problems(scene.loaded.tree, scene)
    problems = [scene.loaded.with_source_line(problem) for problem in sorted(problems)]
    if problems and picture_folder is not None:
        gaps = [gap.position for _, gap in scene.cached(routes.unreachable_goals)]
        file = draw_picture(scene, gaps, picture_folder)
        problems = [replace(problem, hint=f"{problem.hint}; picture: {file}".lstrip("; ")) for problem in problems]
    return problems


def draw_picture(scene: Scene, gaps: Sequence[tuple[float, float]], folder: Path) -> Path:
    """Draw the world, the robot at its start and goals, and `gaps` (x, y) in m. Return the path of the picture.

    Raises UsageError if the picture cannot be written to `folder`.
    """
    from simscen.worlds.built_world import build_world_and_map
    from simscen.worlds.maps.world_picture import draw_world

    low, high = scene.z_range
    height = (low + high) / 2
    poses = [scene.start, *(goal.pose for _, goal in scene.expected_goals)]
    outlines = [transform_polygon(pose, scene.size.footprint) for pose in poses]
    image = draw_world(build_world_and_map(scene.world, height), height, outlines, gaps)
    loaded, robot = scene.loaded, scene.loaded.robot_name
    maps = (loaded.world.map, loaded.map, loaded.keepout_mask, loaded.speed_mask)
    file = folder / f"{loaded.title}{f'_{robot}' if robot else ''}.png"
    try:
        require_regular_file(file)
        require_not_input(file, [map_.image for map_ in maps if isinstance(map_, LoadedMap)])
        file.parent.mkdir(parents=True, exist_ok=True)
        image.save(file)
    except OSError as error:
        raise UsageError(f"cannot write the picture {file}: {error.strerror}") from error
    return file


def world_file_warnings(source: LoadedWorld, root: Path, world_path: Sequence[Path], lenient: bool) -> list[Problem]:
    """Build the world `source`, and return warnings about the world. Raises InvalidInput for unusable files."""
    notes = list(source.map.notes) if source.map else []
    world = world_from_file(source, root, world_path, lenient)
    return [*notes, *check_built_world(world, source), *world_reader_notes(world, source, root)]


def world_reader_notes(world: World, source: LoadedWorld, root: Path) -> list[Problem]:
    """Return the notes of a built world as warnings about its file `source`."""
    display_name = path_in_messages(source.path, root)
    return [
        Problem(display_name, 0, 0, "SC311", note.removeprefix(f"{display_name}: "), severity="warning")
        for note in world.notes
    ]


def _with_robot_spec(loaded: LoadedScenario) -> LoadedScenario:
    """Return the scenario with the specification of its robot, which is inferred for a URDF alone."""
    if loaded.robot.spec is not None:
        return loaded
    return replace(loaded, robot=replace(loaded.robot, spec=load_robot(loaded)[0]))


def _has_errors(problems: Iterable[Problem]) -> bool:
    return any(problem.severity == "error" for problem in problems)
