"""Tests of the reference page of the commands: options and exit codes."""

import re

import pytest
import typer

from simscen.cli.catalog.commands_page import (
    EXIT_CODES,
    command_section,
    exit_code_section,
    functions_of_command,
    parameters_of,
)
from simscen.cli.main import COMMANDS, app
from simscen.core.errors import Exit


def calls():
    """Return the words of each command, such as "world inspect", and its function."""
    return [(words, function) for name in COMMANDS for words, function in functions_of_command(name)]


def typer_command(words):
    """Return the typer command with these words."""
    command = typer.main.get_command(app)
    for word in words.split():
        command = command.get_command(None, word)
    return command


@pytest.mark.parametrize(("words", "function"), calls(), ids=lambda value: value if isinstance(value, str) else "")
def test_commands_page_lists_the_options_of_typer(words, function) -> None:
    parameters = [
        parameter
        for parameter in typer_command(words).params
        if parameter.name != "help" and not getattr(parameter, "hidden", False)
    ]
    names = [", ".join(p.opts) if p.param_type_name == "option" else p.name for p in parameters]
    output = [parameter.spelling for parameter in parameters_of(function)]
    arguments = re.compile(r"^\[?[A-Z_]+\]?…?$")
    assert [name for name in names if name.startswith("-")] == [name for name in output if name.startswith("-")]
    assert len(output) == len(names)
    assert all(name.startswith("-") or arguments.match(name) for name in output)
    assert all(parameter.help for parameter in parameters_of(function))


def test_every_exit_code_is_documented() -> None:
    assert set(EXIT_CODES) == set(Exit)
    assert all(f"| {code.value} |" in exit_code_section() for code in Exit)


def test_stars_and_brackets_are_escaped() -> None:
    assert r"\*.scenario.yaml" in command_section("validate", dict(calls())["validate"])
    assert r"simscen-out/\<session id>" in command_section("run", dict(calls())["run"])


def test_default_of_zero_is_listed_and_code_is_not_escaped() -> None:
    sections = "".join(command_section(words, function) for words, function in calls())
    assert "| `--port` | integer, 0 to 65535 | `0` |" in sections
    assert "$schema=<path>/scenario.schema.json`" in sections
