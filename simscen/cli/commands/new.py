"""Command `simscen new`, which writes a commented scenario, a copy of a scenario, or a scenario from a log."""

import os
import shlex
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.completions import shipped_scenarios
from simscen.cli.diagnostics import escaped, print_text, relative_to_working_folder
from simscen.cli.session.user_files import create_file
from simscen.core.errors import InvalidInput, UsageError
from simscen.core.version import PACKAGE
from simscen.loading.files.discovery import BASE_SUFFIXES, SCENARIO_SUFFIXES, default_root
from simscen.loading.files.paths import is_unusable_name
from simscen.loading.scenario import try_variations
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.yaml.library import DEFAULTS_FILE


def command(
    name: Annotated[
        str, typer.Argument(help="Name or path, e.g. `aisle` for aisle.scenario.yaml; not with --out.")
    ] = "",
    like: Annotated[
        str,
        typer.Option(
            metavar="SCENARIO",
            help="Copy this scenario and the files it needs: a file, or the name of a shipped scenario.",
            autocompletion=completions.scenarios_to_copy,
        ),
    ] = "",
    from_log: Annotated[
        Path | None,
        typer.Option(
            metavar="LOG",
            help="Reconstruct the scenario from a recorded drive: an MCAP file or a rosbag2 folder.",
            autocompletion=completions.logs,
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="With --from-log: output file; default: NAME, or the name of the log.")
    ] = None,
    map_: Annotated[
        Path | None, typer.Option("--map", help="With --from-log: ROS map (yaml) to use instead of the map in the log.")
    ] = None,
    world: Annotated[
        Path | None, typer.Option(help="With --from-log: world file to use instead of walls from the map.")
    ] = None,
    robot: Annotated[
        str,
        typer.Option(
            help="With --from-log: robot file, or the name of a shipped robot; with several robots in a log of "
            "simscen, the name of one of them: the others become moving objects."
        ),
    ] = "",
    truth: Annotated[
        str | None,
        typer.Option(
            help="With --from-log: topic of the true pose, or `none`; default: the topic of simscen's own logs."
        ),
    ] = None,
    topic: Annotated[
        list[str] | None,
        typer.Option(help="With --from-log: NAME=TOPIC, other name of a standard topic, e.g. scan=/front/scan."),
    ] = None,
    root: Annotated[
        Path | None,
        typer.Option(help="With --from-log: root of the recorded scenario, to find its world; default: this folder."),
    ] = None,
    verify: Annotated[
        bool, typer.Option("--verify", help="With --from-log: run the scenario, and compare the run with the log.")
    ] = False,
) -> None:
    """Write a commented scenario to start from.

    The scenario is valid and passes. With --like, the scenario is a copy of another one; worlds, maps, and robots
    outside of the project are copied into a folder beside the new file. A name that ends in .base.yaml, or
    defaults.yaml, creates a base file for scenarios to extend. If the project has a folder `schemas`, the file refers
    to the schema for editors. Existing files are never overwritten.

    With --from-log, the scenario is reconstructed from a recorded drive of simscen or of a real robot (MCAP, or a
    rosbag2 folder). It contains the goals, unmapped objects, faults of sensors, and criteria that the drive met or
    violated. A comment gives the evidence for each part, and the first lines list facts that the log does not show.
    --verify runs the scenario, compares the run with the log, and writes a page that shows both.

    Exit code 0: written; 1: with --verify, an incident of the log does not happen again; 2: an input is unusable, or a
    file cannot be written; 3: with --verify, the run could not be completed.
    """
    if from_log is not None:
        if like:
            raise UsageError("--like and --from-log exclude each other")
        from simscen.cli.session.from_log import write_scenario_from_log
        from simscen.reconstruction.scenario.given_parts import GivenFiles

        target, files = _target(name, out, from_log), GivenFiles(world, map_, robot)
        write_scenario_from_log(from_log, target, files, truth, topic or [], root, verify)
        return
    options = {"out": out, "map": map_, "world": world, "robot": robot, "truth": truth, "topic": topic, "root": root}
    for option, value in {**options, "verify": verify}.items():
        if value:
            raise UsageError(f"--{option} needs --from-log")
    if not name:
        raise UsageError("missing argument NAME")
    last = name.rpartition("/")[2]
    suffix = next((suffix for suffix in SCENARIO_SUFFIXES if last.endswith(suffix)), "")
    if is_unusable_name(last.removesuffix(suffix)):
        raise UsageError(f"{name!r} is not a valid scenario name")
    is_base = last == DEFAULTS_FILE or last.endswith(BASE_SUFFIXES)
    if is_base and like:
        raise UsageError(f"{name!r} is a base file; --like copies only scenarios")
    file = Path(name if is_base or name.endswith(SCENARIO_SUFFIXES) else f"{name}{SCENARIO_SUFFIXES[0]}")
    others: list[Path] = []
    with create_file(file, name):
        if like:
            others = _copy(like, file)
        else:
            _write_starter(file, "base" if is_base else "scenario")
    for other in others:
        print_text(f"wrote {escaped(str(other))}")
    verb = "validate" if is_base else "run"
    print_text(f"wrote {escaped(str(file))}; try: simscen {verb} {escaped(shlex.quote(str(file)))}")


def _target(name: str, out: Path | None, log: Path) -> Path:
    """Return the file to write with --from-log: NAME, --out, or a file named after the log. Raises UsageError."""
    if name and out is not None:
        raise UsageError("give either NAME or --out")
    path = str(out) if out is not None else name or log.resolve().name.partition(".")[0]
    if is_unusable_name(path.rpartition("/")[2].partition(".")[0]):
        raise UsageError(f"{path!r} is not a valid scenario name")
    return Path(path if path.endswith((".yaml", ".yml")) else f"{path}{SCENARIO_SUFFIXES[0]}")


def _write_starter(file: Path, kind: str) -> None:
    """Write a commented file of this kind, "scenario" or "base", that simscen ships.

    If the project has a schema for it in a folder `schemas` beside or above the file, the first line refers to it.
    """
    text = (PACKAGE / "data" / f"starter.{kind}.yaml").read_text(encoding="utf-8")
    folder, root = file.absolute().parent, default_root([file])
    ancestors = [ancestor for ancestor in (folder, *folder.parents) if ancestor.is_relative_to(root)]
    schemas = [ancestor / "schemas" / f"{kind}.schema.json" for ancestor in ancestors]
    if schema := next((candidate for candidate in schemas if candidate.is_file()), None):
        text = f"# yaml-language-server: $schema={os.path.relpath(schema, folder)}\n{text}"
    file.write_text(text, encoding="utf-8")


def _copy(like: str, file: Path) -> list[Path]:
    """Copy a scenario to `file`, and the files that it needs. Return the copies of these files.

    Raises InvalidInput and UsageError.
    """
    from simscen.loading.files.copying import copy_scenario

    source = _source(like)
    root = default_root([source])
    loaded = try_variations(source, root)
    if isinstance(loaded, list):
        raise InvalidInput(relative_to_working_folder(loaded, root))
    return copy_scenario(loaded[-1], file, default_root([file]))[1:]  # the last variation lists the files of all


def _source(like: str) -> Path:
    """Return the file of the scenario `like`, a path or the name of a shipped scenario. Raises UsageError."""
    if Path(like).is_file():
        return Path(like)
    shipped = shipped_scenarios()
    matches = [path for name, path in shipped.items() if like in (name, name.rpartition("/")[2])]
    if len(matches) == 1:
        return matches[0]
    if matches:
        names = [name for name, path in shipped.items() if path in matches]
        raise UsageError(f"{quoted(like)} is ambiguous; shipped scenarios: {', '.join(names)}")
    hint = suggestion(like, shipped)
    raise UsageError(f"no file and no shipped scenario is called {quoted(like)}" + (f"; {hint}" if hint else ""))
