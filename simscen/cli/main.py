"""`simscen`: finds the command, and is the one place where errors become exit codes."""

import gc
import importlib.util
import os
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from simscen.cli.lazy_import import import_lazily
from simscen.cli.process import COMPLETE, NO_ROOM, PLUGINS, flushed, occupy_descriptors, output_lost, require_folder
from simscen.core.errors import Exit, InvalidInput, SimscenError

COMMANDS = {
    "run": "Run scenarios and report what passed.",
    "validate": "Check scenario, world, robot and stack files without running anything.",
    "list": "List the scenarios that a selection means.",
    "judge": "Judge recorded runs, without simulating them.",
    "report": "Write the reports of an output folder anew.",
    "plot": "Draw a recorded run.",
    "replay": "Make a page that plays a recorded run, or two side by side.",
    "localize": "Run a recorded drive through the localizer alone.",
    "log": "Mend logs, and lay out what viewers show of them.",
    "new": "Write a commented scenario to start from.",
    "explain": "Explain a word of the language, a key, a signal, a metric, a component or a code.",
    "schema": "Print or write the JSON Schemas that editors use.",
    "completion": "Print the script that lets a shell complete commands, options, scenario files and names.",
    "plugins": "List the types that installed packages add to the language and to the stack.",
    "world": "Inspect, convert and export worlds.",
    "robot": "Drive a robot once and compare command, odometry and truth.",
    "ros2": "Stand for a ROS 2 graph, or Nav2, as the stack of a run.",
    "bench": "Measure how fast simscen runs here.",
    "doctor": "Check that this installation can run scenarios.",
}
"""Command → what it does. `simscen.cli.commands.<command>` has a function `command`, or an `app` with commands of its own."""


LIGHT = frozenset({"validate", "list", "schema", "explain", "new", "completion"})
"""Commands that must answer at once. Numpy is a quarter of their start; few of them compute anything."""


def is_light(arguments: Sequence[str]) -> bool:
    """Whether a command line asks for a light command, or only for help or the version."""
    return not arguments or arguments[0] in LIGHT or arguments[0].startswith("-")


class Commands(TyperGroup):
    """Imports a command's module when it is called: `validate` must not wait for pybullet."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Those that are there, in the order of COMMANDS."""
        return [name for name in COMMANDS if importlib.util.find_spec(_module(name))]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command itself; its module is imported now."""
        if cmd_name not in COMMANDS or not importlib.util.find_spec(_module(cmd_name)):
            return None
        if cmd_name in LIGHT or cmd_name == "run":
            import_lazily("numpy")
        module = importlib.import_module(_module(cmd_name))
        gc.freeze()  # what is imported stays: it need never be looked through for garbage
        gc.enable()
        app = getattr(module, "app", None)
        if app is None:
            app = typer.Typer(rich_markup_mode=None, add_completion=False)
            app.command(cmd_name)(module.command)
        command: Any = typer.main.get_command(app)
        command.name = cmd_name
        return command

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """The table of `--help`, without importing any command."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name]) for name in self.list_commands(ctx)])


app = typer.Typer(
    cls=Commands,
    name="simscen",
    rich_markup_mode=None,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    no_args_is_help=True,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"simscen {version('simscen')}")
        raise typer.Exit


@app.callback()
def _simscen(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print it.")
    ] = False,
) -> None:
    """Declarative, deterministic scenario tests for mobile-robot navigation."""


def main() -> None:
    """Run the command line. Every foreseen error is told in words; its exit code says who can mend it."""
    occupy_descriptors()
    # Plug-ins of pydantic that happen to be installed could change what is valid; looking for them costs 12 ms, too,
    # and so does what it imports to look for them.
    os.environ[PLUGINS] = "__all__"
    import_lazily("importlib.metadata", "entry_points")
    if COMPLETE in os.environ:
        from typer.completion import completion_init  # type: ignore[attr-defined]

        completion_init()
    sys.exit(flushed(_called()))


def _called() -> int:
    """Call the command: its exit code, or that of the error which it ends with."""
    try:
        try:
            if sys.argv[1:2] and not sys.argv[1].startswith("-"):
                require_folder()
            app()
        except SimscenError as error:
            return _told(error)
    except SystemExit as end:
        if isinstance(end.__context__, BrokenPipeError):  # where output is not buffered, click meets it first: 1
            return Exit.INCOMPLETE
        return end.code if isinstance(end.code, int) else Exit.PASSED
    except KeyboardInterrupt:
        return Exit.INTERRUPTED
    except BrokenPipeError:
        return Exit.INCOMPLETE
    except OSError as error:
        return output_lost(error) if error.errno in NO_ROOM and not error.filename else _internal()
    except Exception:
        return _internal()
    return Exit.PASSED


def _told(error: SimscenError) -> Exit:
    if isinstance(error, InvalidInput):
        from simscen.cli.diagnostics import as_text, print_text

        print_text(as_text(error.problems), sys.stderr)
    else:
        from simscen.cli.diagnostics import harmless, print_text

        print_text(f"simscen: {harmless(str(error))}", sys.stderr)
    return error.exit


def _internal() -> Exit:
    import traceback

    traceback.print_exc()
    print("simscen: internal error; this is a bug in simscen, please report it with the lines above", file=sys.stderr)
    return Exit.INTERNAL


def _module(command: str) -> str:
    return f"simscen.cli.commands.{command}"


if __name__ == "__main__":
    main()
