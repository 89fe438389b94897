"""Tests of all code blocks in the documentation: each is run, validated, or parsed, or listed with a reason."""

import json
import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import click
import pytest
import typer

from simscen.cli.main import app
from simscen.loading.checks.files import check_file
from simscen.loading.stacks.userconfig import load_config

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # a dependency of pytest

ROOT = Path(__file__).parents[2]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]
FENCED = re.compile(r"^( *)```(\w*)\n(.*?)^\1```", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?<=\n\n)(?:    (?![*-] |\d+\. ).*\n(?:\n(?=    ))?)+", re.MULTILINE)

OWN_TESTS = {
    "docs/tutorials/own-criterion.md": "test_own_packages.py runs all blocks",
    "docs/tutorials/own-planner-and-stack.md": "test_own_packages.py runs all blocks",
    "docs/tutorials/my-stack-process.md": "test_my_stack_process.py runs all blocks",
    "docs/tutorials/my-ros2-stack.md": "tests/ros runs all blocks",
    "docs/guides/github-actions.md": "test_ci_guides.py: pipelines fit GitHub's schema",
    "docs/guides/gitlab.md": "test_ci_guides.py: pipelines fit GitLab's schema",
    "docs/guides/jenkins.md": "test_ci_guides.py",
    "docs/guides/pre-commit.md": "test_ci_guides.py: pre-commit reads them",
    "docs/guides/extends.md": "test_extends_guide.py runs all blocks",
    "docs/reference/language.md": "generated from docstrings; tests/unit/cli/test_catalog.py validates their examples",
}
NOT_RUN = {
    "": "a drawing, or what a command prints",
    "text": "what a command prints, or a ROS program",
    "lua": "configuration of an editor; its schema is tested",
}
NO_COMMANDS = {
    "docs/design/processes.md": "a drawing",
    "docs/guides/command-line.md": "the output folder as a tree",
    "docs/guides/editor.md": "a comment for editors",
    "docs/guides/gazebo-worlds.md": "what a command prints",
    "docs/guides/judge-real-robots.md": "two options of the command above",
    "docs/guides/people.md": "a formula",
    "docs/guides/variations.md": "a decorator of pytest",
}
"""Pages with indented blocks that contain no command."""
PROGRAMS = {
    "simscen",
    "make",
    "pytest",
    "pip",
    "git",
    "docker",
    "python3.11",
    "python",
    ".venv/bin/python",
    "eval",
    "valgrind",
}
PROGRAM = re.compile(r"^(?:\$ )?((?:" + "|".join(map(re.escape, sorted(PROGRAMS))) + r")(?: .*)?)$")
COMMAND = re.compile(r"""((?:"[^"]*"|'[^']*'|(?!\s\s|\s\#).)*)""")
"""A command without the comment behind it, after two blanks or a #."""


class Block(NamedTuple):
    """A block of a page: its first line, its language ("indented" without a fence), and its text."""

    page: str
    line: int
    language: str
    text: str


def blocks() -> Iterator[Block]:
    for page in PAGES:
        name, text = page.relative_to(ROOT).as_posix(), page.read_text(encoding="utf-8")
        for match in FENCED.finditer(text):
            yield Block(name, text[: match.start()].count("\n") + 1, match[2], match[3])
        without_fenced = FENCED.sub(lambda match: re.sub(r"[^\n]", "", match[0]), text)
        for match in INDENTED.finditer(without_fenced):
            yield Block(name, without_fenced[: match.start()].count("\n") + 1, "indented", match[0])


BLOCKS = [block for block in blocks() if block.page not in OWN_TESTS]


def blocks_in(*languages: str) -> list[object]:
    chosen = [block for block in BLOCKS if block.language in languages]
    return [pytest.param(block, id=f"{block.page}:{block.line}") for block in chosen]


def commands(block: Block) -> list[str]:
    """Return the commands in a block, without their comments."""
    lines = [PROGRAM.match(line.strip()) for line in block.text.splitlines()]
    return [COMMAND.match(line[1])[1] for line in lines if line]


@pytest.mark.parametrize("block", blocks_in("console", "sh", "indented"))
def test_shown_command_is_valid(block: Block) -> None:
    shown = commands(block)
    assert shown or block.page in NO_COMMANDS or "= short test summary" in block.text
    for line in shown:
        for part in line.split(" && "):
            program, *words = shlex.split(part)
            if program == "simscen":
                parse_command(words)
            elif program == "make" and words:
                assert re.search(rf"^{words[0]}:.*## ", (ROOT / "Makefile").read_text(), re.MULTILINE)


def parse_command(words: list[str]) -> None:
    """Parse a command line of simscen; raise UsageError if it is invalid."""
    command: click.Command = typer.main.get_command(app)
    context = command.make_context("simscen", list(words))
    while isinstance(command, click.Group):
        name, found, words = command.resolve_command(context, [*context.protected_args, *context.args])
        assert found is not None
        command, context = found, found.make_context(name, list(words), parent=context)


@pytest.mark.parametrize("block", [each for each in blocks_in("yaml") if "simscen: 1" not in each.values[0].text])
def test_partial_yaml_block_is_valid(block: Block, tmp_path: Path) -> None:
    """The blocks are parts of scenarios, which are valid as a base, of robots, or of the user's configuration."""
    if block.page == "docs/guides/temporal-criteria.md":
        pytest.skip("test_temporal_guide.py")
    if re.search(r"^stacks:", block.text, re.MULTILINE):
        (tmp_path / "config.yaml").write_text(block.text)
        assert load_config(tmp_path / "config.yaml").spec.stacks
        return
    kind = "robot" if block.text.startswith("urdf:") else "base"
    file = tmp_path / f"a.{kind}.yaml"
    file.write_text(f"simscen: 1\n{block.text}" if kind == "robot" else block.text)
    for mask in ("keepout", "speed"):
        (tmp_path / "masks").mkdir(exist_ok=True)
        (tmp_path / "masks" / f"{mask}.pgm").touch()
        (tmp_path / "masks" / f"{mask}.yaml").write_text(f"image: {mask}.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n")
    wrong = [str(problem) for problem in check_file(kind, file, tmp_path)]
    # Robots are shown in part, and refer to files of a manufacturer.
    assert [problem for problem in wrong if kind == "base" or not re.search("missing key|no such file", problem)] == []


@pytest.mark.parametrize("block", blocks_in("python", "json", "toml"))
def test_python_json_and_toml_blocks_can_be_parsed(block: Block) -> None:
    match block.language:
        case "python":
            compile(block.text, block.page, "exec")
        case "json":
            json.loads(block.text)
        case "toml":
            tomllib.loads(block.text)


def test_every_block_is_tested_or_has_a_reason() -> None:
    tested = {"console", "sh", "indented", "yaml", "python", "json", "toml"}
    assert {block.language for block in BLOCKS} - tested <= set(NOT_RUN)
    assert {page for page in OWN_TESTS if not (ROOT / page).is_file()} == set()
