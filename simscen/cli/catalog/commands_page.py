"""Text of docs/reference/commands.md, generated from the functions of the commands."""

import importlib
import inspect
import re
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Union, get_args, get_origin

from typer.models import ArgumentInfo, OptionInfo

from simscen.cli.main import COMMANDS
from simscen.core.errors import Exit

EXIT_CODES = {
    Exit.PASSED: "All runs passed, or failed as expected by their scenarios.",
    Exit.FAILED: "A criterion failed, or held although it was expected to fail.",
    Exit.USAGE: "Invalid file, wrong usage, or unusable output folder. Nothing was run.",
    Exit.INCOMPLETE: "A run could not be completed (crash, timeout, out of memory), or a result could not be written.",
    Exit.INTERNAL: "A bug in simscen.",
    Exit.NOTHING_SELECTED: "Nothing was selected, or all selected scenarios are skipped.",
    Exit.UNDECIDED: "The claim of a study, or `--probability` of a search, is undecided: more runs may decide it.",
    Exit.HUNG_UP: "Interrupted by SIGHUP: the terminal was closed.",
    Exit.INTERRUPTED: "Interrupted by Ctrl-C (SIGINT).",
    Exit.TERMINATED: "Interrupted by SIGTERM.",
}
"""Meaning of each exit code."""
_EXAMPLES = {
    "run": 'simscen run scenarios/ -k "faults and not slip" --junit junit.xml',
    "study": "simscen study crossing.study.yaml --runs 200",
    "validate": "simscen validate scenarios/ --picture pictures",
    "list": "simscen list scenarios/ --tag smoke",
    "judge": "simscen judge logs/monday.mcap --scenario limits.yaml --truth /mocap",
    "report": "simscen report simscen-out/latest --parquet tables",
    "merge": "simscen merge out/shard-1 out/shard-2 --out out/all",
    "falsify": "simscen falsify crossing.study.yaml --failures 3",
    "shrink": "simscen shrink simscen-out/latest/runs/crossing/seed-7",
    "compare": "simscen compare out/main out/branch --fail-on flip",
    "plot": "simscen plot run.mcap --out run.png",
    "replay": "simscen replay run.mcap --against other/run.mcap --open",
    "localize": "simscen localize drive.log --map building.yaml --robot turtlebot",
    "log recover": "simscen log recover run.partial.mcap",
    "log layout": "simscen log layout run.mcap --out layout.json",
    "new": "simscen new --from-log incident.mcap --map office.yaml --verify",
    "edit": "simscen edit --new --map office.yaml",
    "explain": "simscen explain stopped_within",
    "schema": "simscen schema --write schemas",
    "completion": "simscen completion zsh",
    "world inspect": "simscen world inspect shop.world --png shop.png",
    "world export": "simscen world export hall.world.yaml --map hall.yaml",
    "world convert": "simscen world convert shop.world shop.world.yaml --world-path models",
    "robot check": "simscen robot check husky.robot.yaml --picture husky.png",
    "ros2": "simscen ros2 nav2 --params nav2_params.yaml",
    "bench": "simscen bench --compare before.json",
    "bench suite": "simscen bench suite scenarios/ --most 100",
    "bench compare": "simscen bench compare before.json after.json",
    "bench nav": 'simscen bench nav --only "narrow fields" --fields 16',
    "bench localization": "simscen bench localization --only scan_matching --buildings 3",
}
"""Example of a command line by the name of the command, such as "world export"."""
_COMMANDS_INTRO = """\
This page lists every command with its options and exit codes; `simscen COMMAND --help` prints the same. To learn the
command line by task, see [The command line](../guides/command-line.md). [Exit codes](#exit-codes) are at the end.
"""
_TYPE_NAMES = {int: "integer", float: "number", str: "text", Path: "path"}
_MARKUP = re.compile(r"[*<]")
"""Characters that Markdown would interpret."""


@dataclass(frozen=True)
class Parameter:
    """Argument or option of a command.

    spelling:  names, such as "-j, --jobs"
    value:     kind of the value, such as "integer, 1 to 256"; "" for a flag
    default:   default value; "" if there is none
    help:      description
    """

    spelling: str
    value: str
    default: str
    help: str


def commands_page() -> str:
    """Return the text of docs/reference/commands.md."""
    functions = {name: list(functions_of_command(name)) for name in COMMANDS}
    rows = "\n".join(
        f"| [`simscen {name}`](#simscen-{functions[name][0][0].replace(' ', '-')}) | {text} |"
        for name, text in COMMANDS.items()
    )
    sections = [command_section(*named) for name in COMMANDS for named in functions[name]]
    table = f"| command | what it does |\n|---|---|\n{rows}\n"
    return "\n".join([f"# Commands\n\n{_COMMANDS_INTRO}\n{table}", *sections, exit_code_section()])


def functions_of_command(name: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield name and function of a command and of each of its subcommands. A name is, for example, "world export"."""
    module = importlib.import_module(f"simscen.cli.commands.{name}")
    app = getattr(module, "app", None)
    if app is None:
        yield name, module.command
        return
    group = app.registered_callback and app.registered_callback.callback
    if group and app.registered_callback.invoke_without_command is True:
        yield name, group
    for info in app.registered_commands:
        if info.callback is not None:
            yield f"{name} {info.name or info.callback.__name__}", info.callback


def parameters_of(function: Callable[..., Any]) -> list[Parameter]:
    """Return the arguments and options of a command from its function, without hidden (deprecated) options."""
    found = []
    # get_type_hints cannot be used: in Python 3.10 it hides Annotated in an Optional if the default is None.
    for parameter in inspect.signature(function, eval_str=True).parameters.values():
        if get_origin(parameter.annotation) is Annotated:
            kind, info = get_args(parameter.annotation)[:2]
            if isinstance(info, ArgumentInfo | OptionInfo) and not info.hidden:
                found.append(_parameter(parameter, kind, info))
    return found


def command_section(command: str, function: Callable[..., Any]) -> str:
    """Return the Markdown section of a command from its name, such as "world export", and its function."""
    rows = [
        f"| `{p.spelling}` | {p.value} | {f'`{p.default}`' if p.default else ''} | {_escape_markdown(p.help.strip())} |"
        for p in parameters_of(function)
    ]
    head = ["| argument or option | value | default | meaning |", "|---|---|---|---|"]
    table = "\n".join([*head, *rows]) if rows else "No arguments or options."
    summary, *paragraphs = _escape_markdown(inspect.cleandoc(function.__doc__ or "")).split("\n\n")
    example = [f"```console\n$ {_EXAMPLES[command]}\n```"] if command in _EXAMPLES else []
    return "\n\n".join([f"## `simscen {command}`", summary, *example, *paragraphs, f"{table}\n"])


def exit_code_section() -> str:
    """Return the Markdown section about exit codes."""
    rows = "\n".join(f"| {code.value} | {text} |" for code, text in EXIT_CODES.items())
    text = "If several apply, the first of 129, 130, 143, 4, 3, 1 is returned."
    return f"## Exit codes\n\n{text}\n\n| code | meaning |\n|---|---|\n{rows}\n"


def _parameter(parameter: inspect.Parameter, kind: Any, info: ArgumentInfo | OptionInfo) -> Parameter:
    is_list, kind = _item_type(kind)
    is_required = parameter.default is inspect.Parameter.empty
    default = "" if is_required or parameter.default is None or parameter.default is False else parameter.default
    if isinstance(info, ArgumentInfo):
        name = (info.metavar or parameter.name).upper()
        spelling = f"{name}…" if is_list else name if is_required else f"[{name}]"
    else:
        # Within Annotated, typer stores the first name as the default.
        names = [name for name in (info.default, *(info.param_decls or ())) if isinstance(name, str)]
        spelling = ", ".join(names or [f"--{parameter.name.replace('_', '-')}"])
    default = str(default.value if isinstance(default, Enum) else default)
    return Parameter(spelling, "" if kind is bool else _value_text(kind, info), default, info.help or "")


def _item_type(kind: Any) -> tuple[bool, Any]:
    """Return whether a type is a list, and the type of a single value. The alternative None is ignored."""
    if get_origin(kind) in (Union, types.UnionType):
        kind = next(member for member in get_args(kind) if member is not type(None))
    is_list = get_origin(kind) is list
    return is_list, get_args(kind)[0] if is_list else kind


def _value_text(kind: Any, info: ArgumentInfo | OptionInfo) -> str:
    """Return the kind of a value with its range, such as "integer, 1 to 256"."""
    if isinstance(kind, type) and issubclass(kind, Enum):
        return " or ".join(f"`{member.value}`" for member in kind)
    text = _TYPE_NAMES[kind]
    if info.min is not None and info.max is not None:
        return f"{text}, {info.min:.12g} to {info.max:.12g}"
    return f"{text}, at least {info.min:g}" if info.min is not None else text


def _escape_markdown(text: str) -> str:
    """Escape text for a cell of a Markdown table. In code between backticks, escape only `|`."""
    parts = text.replace("|", "\\|").split("`")
    return "`".join(part if index % 2 else _MARKUP.sub(r"\\\g<0>", part) for index, part in enumerate(parts))
