"""Command `simscen world`, which inspects, exports, and converts worlds."""

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from pydantic import ValidationError

from simscen.cli.diagnostics import as_text, escaped, paths_from_working_folder, print_text, relative_to_working_folder
from simscen.cli.session.user_files import require_writable, save
from simscen.cli.shared_options import LenientOption, WorldPathOption
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.errors import InvalidInput, Problem
from simscen.loading.builders import world_from_file
from simscen.loading.checks.scene_runner import world_reader_notes
from simscen.loading.files.discovery import default_root
from simscen.loading.files.single_files import load_world_file
from simscen.loading.loaded import LoadedWorld
from simscen.loading.yaml.writing import world_text
from simscen.model.world import WorldSpec
from simscen.report.display_text import number_with_noun
from simscen.run.sessions.output_folder import write_atomically

if TYPE_CHECKING:
    from simscen.worlds.built_world import WorldItem, WorldSummary

app = typer.Typer(rich_markup_mode=None, add_completion=False, no_args_is_help=True)

File = Annotated[Path, typer.Argument(metavar="WORLD", help="A *.world.yaml, a ROS map (yaml), an SDF or .world file.")]
Root = Annotated[Path | None, typer.Option(help="Root folder; the world may only refer to files below it.")]
Height = Annotated[float, typer.Option(min=0.0, max=100.0, help="Height of the lidar in meters.")]
LIDAR_HEIGHT_M = 0.2
"""Default height of the lidar. The cross-section of a world is taken at this height."""


@app.callback()
def _world() -> None:
    """Inspect, convert, and export worlds."""


@app.command()
def inspect(
    path: File,
    png: Annotated[Path | None, typer.Option(help="Draw the cross-section at lidar height and the map (png).")] = None,
    height: Height = LIDAR_HEIGHT_M,
    lists_all: Annotated[bool, typer.Option("--all", help="List all solids instead of the first ones.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
    root: Root = None,
    world_path: WorldPathOption = None,
    lenient: LenientOption = False,
) -> None:
    """Print the content of a world: solids, bodies, extents, triangles, places, regions, and warnings.

    Exit code 0: printed; 2: the file, or a file that it uses, is unusable.
    """
    from simscen.worlds.built_world import inspect_world
    from simscen.worlds.maps.map_size import MAP_RESOLUTION_M

    root_folder = root or default_root([path])
    source = _load(path, root_folder, world_path)
    world = _build(source, root_folder, world_path, lenient)
    built = _with_map(world, path, height, MAP_RESOLUTION_M, "in scenarios, use `map: none`")
    summary = inspect_world(built)
    if as_json:
        print(json.dumps(asdict(summary), indent=2))
    else:
        print_text("\n".join([escaped(f"{summary.name} · {path}"), *summary_lines(summary, height, lists_all)]))
        warnings = relative_to_working_folder(world_reader_notes(built.world, source, root_folder), root_folder)
        if warnings:
            print_text(as_text(warnings))
    if png is not None:
        from simscen.worlds.maps.world_picture import draw_world

        save(png, lambda file: draw_world(built, height).save(file, format="PNG"), _input_files(source))


@app.command()
def export(
    path: File,
    map_: Annotated[Path, typer.Option("--map", help="Map YAML file to write; its image (pgm) is written beside it.")],
    height: Height = LIDAR_HEIGHT_M,
    resolution: Annotated[float, typer.Option(min=0.005, max=1.0, help="Cell size in meters.")] = 0.05,
    root: Root = None,
    world_path: WorldPathOption = None,
    lenient: LenientOption = False,
) -> None:
    """Write a world as a ROS map for Nav2's map_server, as SLAM with a perfect lidar would have built it.

    A world with its own map keeps the resolution of that map.

    Exit code 0: written; 2: the world is unusable, or the map cannot be written.
    """
    from simscen.worlds.maps.ros_map import save_map

    root_folder = root or default_root([path])
    source = _load(path, root_folder, world_path)
    world = _build(source, root_folder, world_path, lenient)
    grid = _with_map(world, path, height, resolution, "choose larger cells with --resolution").map
    require_writable(map_.with_suffix(".pgm"), _input_files(source))
    save(map_, lambda file: save_map(grid, file), _input_files(source))
    rows, columns = grid.shape
    print_text(f"{escaped(str(map_))}: {columns} x {rows} cells of {grid.resolution:g} m")


@app.command()
def convert(
    path: File,
    out: Annotated[Path, typer.Argument(help="*.world.yaml file to write.")],
    height: Height = LIDAR_HEIGHT_M,
    root: Root = None,
    world_path: WorldPathOption = None,
    lenient: LenientOption = False,
) -> None:
    """Convert a world to a *.world.yaml file.

    Upright boxes, cylinders, and prisms are kept; meshes and all other shapes become upright prisms over their
    cross-section at lidar height. Each change is printed. A ROS map is not copied; the world refers to the map file.

    Exit code 0: written; 2: the world is unusable or cannot be written.
    """
    root_folder = root or default_root([path])
    source = _load(path, root_folder, world_path)
    spec, changes = _convert(source, root_folder, world_path, lenient, height)
    if source.map is not None:
        map_path = os.path.relpath(source.map.path.resolve(), out.resolve().parent)
        spec = spec.model_copy(update={"map": Path(map_path).as_posix()})
    content = world_text(spec).encode()
    save(out, lambda file: write_atomically(file, content), _input_files(source))
    for change in changes:
        print_text(f"changed: {escaped(change)}")
    count = len(spec.walls) + len(spec.obstacles) + len(spec.objects) + len(spec.doors)
    print_text(f"{escaped(str(out))}: {count} walls, obstacles, objects, and doors; {len(changes)} changed")


def _convert(
    source: LoadedWorld, root_folder: Path, world_path: list[Path] | None, lenient: bool, height: float
) -> tuple[WorldSpec, list[str]]:
    """Return the content of the world file, and a description of each change. Raises InvalidInput.

    `height` is the height of the lidar in m.
    """
    spec = source.spec or WorldSpec(simscen=1, name=source.name)
    if source.sdf is None:
        return spec, []
    from simscen.worlds.conversion import convert_world

    world = _build(replace(source, spec=None, map=None), root_folder, world_path, lenient)
    try:
        conversion = convert_world(world, height)
        return conversion.merged_into(spec), [*conversion.changes, *world.notes]
    except ValidationError as error:
        found = [
            (".".join(map(str, detail["loc"])), detail["msg"].removeprefix("Value error, "))
            for detail in error.errors()[:3]
        ]
        details = "; ".join(": ".join(filter(None, parts)) for parts in found)
        message = f"the world cannot be written as a world file: {details}"
        raise InvalidInput([Problem(str(source.path), 0, 0, "SC312", message)]) from None


def _load(path: Path, root_folder: Path, world_path: list[Path] | None) -> LoadedWorld:
    with paths_from_working_folder(root_folder):
        return load_world_file(path, root_folder, world_path or ())


def _input_files(source: LoadedWorld) -> list[Path]:
    """Return the file of a world, and the files of its map and of its SDF world."""
    map_files = [] if source.map is None else [source.map.path, source.map.image]
    return [source.path, *map_files, *([] if source.sdf is None else [source.sdf])]


def _build(source: LoadedWorld, root_folder: Path, world_path: list[Path] | None, lenient: bool) -> World:
    with paths_from_working_folder(root_folder):
        return world_from_file(source, root_folder, world_path or (), lenient)


def _with_map(world: World, path: Path, height: float, resolution: float, alternative: str) -> BuiltWorld:
    """Build a world and its map. Raises InvalidInput for the file `path` if the map would be too large.

    `alternative` is a further hint: what the user can do instead of changing the world.
    """
    from simscen.worlds.built_world import build_world_and_map

    try:
        return build_world_and_map(world, height, resolution)
    except InvalidInput as error:
        raise InvalidInput(
            [replace(problem, path=str(path), hint=f"{problem.hint}, or {alternative}") for problem in error.problems]
        ) from error


MAX_SOLIDS = 20
"""Maximum number of solids that are listed without --all."""
MAX_NAME_LENGTH = 44
"""Maximum number of printed characters of a name. Only the end of a longer name is printed."""


def summary_lines(summary: "WorldSummary", height: float, lists_all: bool) -> Iterator[str]:
    """Yield the printed lines about a world. `height` is the height of the cross-section in m.

    If `lists_all` is false, only the first MAX_SOLIDS solids are listed.
    """
    x0, y0, x1, y1 = summary.bounds
    yield f"  bounds    x {x0:.2f} … {x1:.2f} m, y {y0:.2f} … {y1:.2f} m ({x1 - x0:.2f} x {y1 - y0:.2f} m)"
    kinds = ", ".join(f"{count} {kind}" for kind, count in summary.shapes)
    yield f"  static    {number_with_noun(len(summary.solids), 'solid')}{f': {kinds}' if kinds else ''}"
    yield f"  moving    {number_with_noun(len(summary.bodies), 'object')}"
    yield f"  triangles {summary.triangles}"
    rows, columns = summary.map_size
    occupied, free, unknown = (f"{100 * share:.1f} %" for share in summary.map_shares)
    yield f"  map       {columns} x {rows} cells of {summary.map_resolution:g} m, cut at {height:g} m: " + (
        f"{occupied} occupied, {free} free, {unknown} unknown"
    )
    yield from _item_lines("solids", summary.solids, len(summary.solids) if lists_all else MAX_SOLIDS)
    yield from _item_lines("objects", summary.bodies, len(summary.bodies))
    for title, names in (("places", summary.places), ("regions", summary.regions)):
        if names:
            yield f"  {title:9} {escaped(', '.join(names))}"


def _item_lines(title: str, items: "Sequence[WorldItem]", max_count: int) -> Iterator[str]:
    """Yield a title, and a line for each of the first `max_count` items."""
    if items:
        yield f"  {title}"
    width = max((min(len(escaped(item.name)), MAX_NAME_LENGTH) for item in items[:max_count]), default=0)
    yield from (f"    {_item_line(item, width)}" for item in items[:max_count])
    if len(items) > max_count:
        yield f"    … and {len(items) - max_count} more (--all lists them)"


def _item_line(item: "WorldItem", width: int) -> str:
    """Return the line of an item: name (padded to `width`), shape, triangles, extent, and mass."""
    x0, y0, z0, x1, y1, z1 = item.extent
    name = escaped(item.name)
    short_name = name if len(name) <= MAX_NAME_LENGTH else f"…{name[1 - MAX_NAME_LENGTH :]}"
    extent = f"x {x0:.2f} … {x1:.2f}  y {y0:.2f} … {y1:.2f}  z {z0:.2f} … {z1:.2f}"
    mass = "" if item.mass is None else f"  {item.mass:g} kg" if item.mass else "  cannot be pushed"
    return f"{short_name:{width}}  {item.shape:9} {item.triangles:7} triangles  {extent}{mass}"
