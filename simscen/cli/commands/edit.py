"""Command `simscen edit`, which serves the editor of a scenario or a world as a local web page."""

import os
import signal
import sys
import threading
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import escaped, paths_from_working_folder, print_text
from simscen.cli.shared_options import LenientOption, RootOption, WorldPathOption
from simscen.core.errors import Exit, InvalidInput, Problem, UsageError
from simscen.loading.files.discovery import SCENARIO_SUFFIXES, STUDY_SUFFIXES, default_root

if TYPE_CHECKING:
    from simscen.editor.document import EditedFile

SUFFIX = SCENARIO_SUFFIXES[0]
"""Suffix of a new scenario file."""


def command(
    file: Annotated[
        Path | None, typer.Argument(help="A scenario or a *.world.yaml.", autocompletion=completions.yaml_files)
    ] = None,
    new: Annotated[bool, typer.Option("--new", help="Start a new scenario; needs --map.")] = False,
    map_: Annotated[
        Path | None,
        typer.Option("--map", help="World of the new scenario: a *.world.yaml, a ROS map (yaml), or an SDF file."),
    ] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Print the address without opening it.")] = False,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the local server; 0: any free port.")] = 0,
    stack: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=VALUE",
            autocompletion=completions.stacks,
            help="Run the scenario with this stack instead of its own, as in `simscen run`.",
        ),
    ] = None,
    root: RootOption = None,
    world_path: WorldPathOption = None,
    lenient: LenientOption = False,
) -> None:
    """Edit a scenario or a world on its map, in a browser.

    The page shows the map and the text of the file side by side. An edit on the map or in a form changes only the
    edited values in the text; comments, order, and formatting stay. Problems are shown while you edit. Nothing is
    written until you save. If another program has changed the file, the page asks before it overwrites the file. The
    button Run simulates the text without saving it. The page is served on this machine only, at an address with a
    secret token, until you press Ctrl-C.

    Exit code 0: ended with Ctrl-C; 2: the file or an option is unusable; 129 and 143: ended by another signal.
    """
    edited, text = _edited_file(file, new, map_, root, tuple(world_path or ()), lenient)
    if stack is not None and edited.kind != "scenario":
        raise UsageError("--stack has no effect on a world, which does not run; edit a scenario")
    from simscen.cli.session.backends import backend_of
    from simscen.cli.session.stacks import parse_stacks
    from simscen.editor.server import EditorServer
    from simscen.editor.session import EditorSession
    from simscen.run.sessions.run_session import SessionOptions

    stacks = parse_stacks([] if stack is None else [stack], edited.root, edited.world_path)
    choice = next(iter(stacks.choices), None)
    session = EditorSession(edited, lambda: backend_of(SessionOptions()), text, lenient, choice, stacks.with_command)
    try:
        server = EditorServer(session, port)
    except OSError as error:
        session.runs.close()
        raise UsageError(f"port {port} cannot be used: {error.strerror}; choose another with --port") from error
    with server:
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is not signal.SIG_IGN:  # with nohup, SIGHUP is ignored
                signal.signal(number, lambda number, _: sys.exit(Exit(128 + number)))
        try:
            print_text(f"editing {escaped(edited.display_name)} at {server.url}\npress Ctrl-C to end")
            sys.stdout.flush()
            if not no_browser:
                # A browser in the terminal waits for the page, which the server below sends.
                threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()
            server.serve_forever()
        except KeyboardInterrupt:
            print_text("")
        finally:
            server.stop_runs()


def _edited_file(
    file: Path | None,
    new: bool,
    map_: Path | None,
    root: Path | None,
    world_path: tuple[Path, ...],
    lenient: bool,
) -> tuple["EditedFile", str]:
    """Return the file to edit, and the text of a new file ("" for an existing file).

    Raises UsageError and InvalidInput.
    """
    if new != (map_ is not None):
        raise UsageError("--new and --map belong together: simscen edit --new --map office.yaml [FILE]")
    if map_ is not None:
        return _new_file(file, map_, root, world_path, lenient)
    if file is None:
        raise UsageError("name the file to edit, or start a new one with --new --map office.yaml")
    if not file.is_file():
        reason = "it is not a regular file" if file.exists() else "no such file"
        raise InvalidInput([Problem(str(file), 0, 0, "SC001", reason, "start a new one with --new --map office.yaml")])
    from simscen.loading.checks.files import file_kind
    from simscen.loading.files.assets import SDF_SUFFIXES

    root_folder = root or default_root([file])
    kind = "scenario" if file.name.endswith((*SCENARIO_SUFFIXES, *STUDY_SUFFIXES)) else file_kind(file, root_folder)
    if kind not in ("scenario", "world") or file.name.endswith(SDF_SUFFIXES):
        hint = "edit takes a scenario or a *.world.yaml; for other maps use: simscen edit --new --map FILE"
        message = f"is a {'Gazebo world' if kind == 'world' else f'{kind} file'}"
        raise InvalidInput([Problem(str(file), 0, 0, "SC001", message, hint)])
    return _with_absolute_paths(file, kind, root_folder, world_path), ""


def _new_file(
    file: Path | None, map_: Path, root: Path | None, world_path: tuple[Path, ...], lenient: bool
) -> tuple["EditedFile", str]:
    """Return a new scenario file for a map, and its text. Raises UsageError and InvalidInput."""
    from simscen.editor.new_scenario import new_scenario_text

    target = file or Path(f"{map_.name.split('.')[0]}{SUFFIX}")
    if not target.name.endswith(SCENARIO_SUFFIXES):
        stem = target.stem if target.suffix in (".yaml", ".yml") else target.name
        target = target.with_name(f"{stem}{SUFFIX}")
    if target.exists():
        raise UsageError(f"{target} already exists; edit it without --new, or choose another name")
    if not target.absolute().parent.is_dir():
        raise UsageError(f"{target.parent} is not a folder; create it first")
    root_folder = root or default_root([target, map_])
    with paths_from_working_folder(root_folder):
        text = new_scenario_text(target, map_, root_folder, world_path, lenient)
    return _with_absolute_paths(target, "scenario", root_folder, world_path), text


def _with_absolute_paths(file: Path, kind: str, root: Path, world_path: tuple[Path, ...]) -> "EditedFile":
    """Return the file to edit with absolute paths. Raises InvalidInput if it is outside of the root and world path.

    Symbolic links to folders are resolved, but a symbolic link to the file itself is not.
    """
    from simscen.editor.document import EditedFile
    from simscen.loading.files.paths import PathSandbox

    path = Path(os.path.realpath(file.parent)) / file.name
    edited = EditedFile(path, kind, Path(os.path.realpath(root)), world_path)
    resolved = PathSandbox.around(edited.root, edited.world_path).resolve_argument(file)
    if isinstance(resolved, Problem):
        raise InvalidInput([resolved])
    return edited
