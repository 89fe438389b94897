"""Tests that all commands and options in the documentation exist."""

import re
from functools import cache
from pathlib import Path

import pytest

from simscen.cli.catalog.commands_page import functions_of_command, parameters_of
from simscen.cli.main import COMMANDS
from simscen.core.errors import Exit

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
SHOWN = re.compile(r"\bsimscen ([a-z]+)\b([^`#\n]*)")
OPTION = re.compile(r"(?<!\S)(--?[a-z][a-z-]*)(?=[\s=…]|$)")
QUOTED = re.compile(r"\"[^\"]*\"|'[^']*'")
"""Other commands, such as those of stacks."""
GLOBAL = {"--help", "--version"}


@cache
def shown() -> list[tuple[str, str, str]]:
    """Return pages, their commands, and the rest of the line."""
    found = []
    for page in PAGES:
        for match in SHOWN.finditer(page.read_text(encoding="utf-8")):
            name, rest = match[1], QUOTED.sub("…", match[2])
            if name in COMMANDS:
                found.append((page.relative_to(ROOT).as_posix(), name, rest))
    return found


@pytest.mark.parametrize("page", sorted({page for page, _, _ in shown()}))
def test_shown_options_of_commands_exist(page: str) -> None:
    unknown = []
    for where, name, rest in shown():
        if where == page:
            words = f"{name} {rest.split()[0]}" if rest.split() else name
            functions = dict(functions_of_command(name))
            function = functions.get(words) or functions.get(name) or next(iter(functions.values()))
            known = {option for p in parameters_of(function) for option in p.spelling.split(", ")} | GLOBAL
            unknown += [f"simscen {name} {option}" for option in OPTION.findall(rest) if option not in known]
    assert unknown == []


def test_the_guide_lists_every_exit_code() -> None:
    table = (ROOT / "docs/guides/command-line.md").read_text(encoding="utf-8").partition("## Exit codes")[2]
    listed = {int(code) for row in re.findall(r"^\| ([\d, ]+) \|", table, re.MULTILINE) for code in row.split(",")}
    assert listed == {code.value for code in Exit}
