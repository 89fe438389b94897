"""Command group `simscen`: dispatches to the commands and converts errors to exit codes."""

import gc
import importlib.util
import os
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from simscen.cli.process import (
    COMPLETION_VARIABLE,
    INACCESSIBLE_PATH_ERRNOS,
    OUTPUT_LOST_ERRNOS,
    PYDANTIC_PLUGINS_VARIABLE,
    flush_output,
    reopen_closed_streams,
    report_lost_output,
    require_working_directory,
)
from simscen.core.errors import Exit, InvalidInput, SimscenError, UsageError


class _LazyModule(ModuleType):
    """Placeholder for a module that is imported when one of its attributes is first accessed."""

    def __getattr__(self, name: str) -> Any:
        # The import system reads such names. Only __path__ needs the module, to import submodules.
        if name.startswith("__") and name != "__path__":
            raise AttributeError(name)
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        real = importlib.import_module(self.__name__)
        self.__dict__.update(vars(real))
        self.__class__ = ModuleType  # type: ignore[assignment]
        return getattr(real, name)


def import_lazily(name: str, *functions: str) -> None:
    """Put a placeholder into `sys.modules`, which imports the module when one of its attributes is first accessed.

    The functions named in `functions` can be accessed without an import: they import the module when they are called.
    """
    if name in sys.modules:
        return
    module = _LazyModule(name)
    module.__spec__ = importlib.util.find_spec(name)
    if functions:  # `from NAME import FUNCTION` reads __path__, which would import the module
        module.__path__ = (module.__spec__ and module.__spec__.submodule_search_locations) or []
    for function in functions:
        setattr(module, function, _lazy_function(name, function))
    sys.modules[name] = module
    parent, _, child = name.rpartition(".")
    if parent:
        setattr(sys.modules[parent], child, module)


def _lazy_function(module: str, function: str) -> Any:
    """Return a function that imports the module, and then calls the function of this name in the module."""

    def call(*arguments: Any, **keywords: Any) -> Any:
        if isinstance(sys.modules[module], _LazyModule):
            del sys.modules[module]
        return getattr(importlib.import_module(module), function)(*arguments, **keywords)

    return call


COMMANDS = {
    "run": "Run scenarios and report what passed.",
    "study": "Run one scenario many times: how often does it fail, and what makes it fail?",
    "validate": "Check scenario, world, robot, and stack files without running anything.",
    "list": "List the scenarios that a selection matches.",
    "judge": "Evaluate criteria on recorded runs without simulating them.",
    "report": "Write the reports of an output folder again.",
    "merge": "Merge the output folders of shards into one.",
    "falsify": "Search the ranges of a scenario for values with which it fails.",
    "shrink": "Find the smallest scenario that still fails in the same way.",
    "compare": "Compare the runs of two output folders, such as of two commits.",
    "plot": "Draw a recorded run as a picture.",
    "replay": "Write a page that plays a recorded run, or two runs side by side.",
    "localize": "Run a localizer on a recorded drive.",
    "log": "Recover damaged logs and write layouts for viewers.",
    "new": "Write a commented scenario to start from.",
    "edit": "Edit a scenario or a world on its map, in a browser.",
    "explain": "Explain a key, criterion, fault, signal, metric, component, or code.",
    "schema": "Print or write the JSON Schemas that editors use.",
    "completion": "Print the shell completion script.",
    "plugins": "List the types that installed packages add.",
    "world": "Inspect, convert, and export worlds.",
    "robot": "Drive a robot and compare command, odometry, and truth.",
    "ros2": "Connect a ROS 2 graph, such as Nav2, as the stack of a run.",
    "bench": "Measure speed, navigation, and localization.",
    "doctor": "Check that this installation can run scenarios.",
}
"""Help text of each command by name.

The module `simscen.cli.commands.<name>` has a function `command`, or a typer application `app` with subcommands.
"""

LIGHT_COMMANDS = frozenset({"validate", "list", "schema", "explain", "new", "completion"})
"""Commands that must start fast, and therefore import NumPy only when they use it."""


def calls_light_command(arguments: Sequence[str]) -> bool:
    """Return whether the arguments of `simscen` call one of LIGHT_COMMANDS, or only request the help or the version."""
    return not arguments or arguments[0] in LIGHT_COMMANDS or arguments[0].startswith("-")


class CommandGroup(TyperGroup):
    """Command group that imports only the module of the called command."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of the available commands in the order of COMMANDS."""
        return [name for name in COMMANDS if importlib.util.find_spec(_module_name(name))]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Import the module of a command, and return the command; None for an unknown command."""
        if cmd_name not in COMMANDS or not importlib.util.find_spec(_module_name(cmd_name)):
            return None
        if cmd_name in LIGHT_COMMANDS or cmd_name == "run":
            import_lazily("numpy")
        module = importlib.import_module(_module_name(cmd_name))
        gc.freeze()  # imported modules live until the end, so the garbage collector need not scan them
        gc.enable()
        app = getattr(module, "app", None)
        if app is None:
            app = typer.Typer(rich_markup_mode=None, add_completion=False)
            app.command(cmd_name)(module.command)
        command: Any = typer.main.get_command(app)
        command.name = cmd_name
        return command

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the table of commands for `--help` without importing any command."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name]) for name in self.list_commands(ctx)])


app = typer.Typer(
    cls=CommandGroup,
    name="simscen",
    rich_markup_mode=None,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    no_args_is_help=True,
)


def _print_version_and_exit(is_requested: bool) -> None:
    if is_requested:
        from importlib.metadata import version

        typer.echo(f"simscen {version('simscen')}")
        raise typer.Exit


@app.callback()
def _simscen(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version_and_exit, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Run declarative, deterministic scenario tests for mobile-robot navigation."""


def main() -> None:
    """Run the command and exit. A SimscenError is printed without a traceback, and determines the exit code."""
    reopen_closed_streams()
    # Pydantic plug-ins of other packages could change which files are valid, and searching for them takes time.
    os.environ[PYDANTIC_PLUGINS_VARIABLE] = "__all__"
    import_lazily("importlib.metadata", "entry_points")
    if COMPLETION_VARIABLE in os.environ:
        from typer.completion import completion_init  # type: ignore[attr-defined]

        completion_init()
    sys.exit(flush_output(_run_command()))


def _run_command() -> int:
    """Run the command, print its error if it fails, and return the exit code."""
    try:
        try:
            if sys.argv[1:2] and not sys.argv[1].startswith("-"):
                require_working_directory()
            app()
        except SimscenError as error:
            return _print_error(error)
    except SystemExit as end:
        if isinstance(end.__context__, BrokenPipeError):  # click turns it into exit code 1 if output is unbuffered
            return Exit.INCOMPLETE
        return end.code if isinstance(end.code, int) else Exit.PASSED
    except KeyboardInterrupt:
        return Exit.INTERRUPTED
    except BrokenPipeError:
        return Exit.INCOMPLETE
    except OSError as error:
        if error.errno in OUTPUT_LOST_ERRNOS and not error.filename:
            return report_lost_output(error)
        if error.errno in INACCESSIBLE_PATH_ERRNOS and error.filename:
            return _print_error(UsageError(f"cannot access {error.filename}: {error.strerror}"))
        return _print_internal_error()
    except Exception:
        return _print_internal_error()
    except BaseException as error:
        from simscen.run.process.supervisor import Interrupted  # light commands do not need it

        if not isinstance(error, Interrupted):
            raise
        return 128 + error.number
    return Exit.PASSED


def _print_error(error: SimscenError) -> Exit:
    from simscen.cli.diagnostics import as_text, escaped, print_text

    text = as_text(error.problems) if isinstance(error, InvalidInput) else f"simscen: {escaped(str(error))}"
    print_text(text, sys.stderr)
    return error.exit


def _print_internal_error() -> Exit:
    """Print the traceback of the current exception as a bug of simscen, and return INTERNAL."""
    import traceback

    traceback.print_exc()
    message = "this is a bug in simscen; please report it with the traceback above"
    print(f"simscen: internal error: {message}", file=sys.stderr)
    return Exit.INTERNAL


def _module_name(command: str) -> str:
    return f"simscen.cli.commands.{command}"


if __name__ == "__main__":
    main()
