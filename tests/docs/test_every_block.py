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
    import tomli as tomllib  # pytest brings it there

ROOT = Path(__file__).parents[2]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]
FENCED = re.compile(r"^( *)```(\w*)\n(.*?)^\1```", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?<=\n\n)(?:    (?![*-] |\d+\. ).*\n(?:\n(?=    ))?)+", re.MULTILINE)

OWN_TESTS = {
    "docs/tutorials/own-criterion.md": "test_own_packages.py does all of it",
    "docs/tutorials/own-planner-and-stack.md": "test_own_packages.py does all of it",
    "docs/tutorials/my-stack-process.md": "test_my_stack_process.py does all of it",
    "docs/tutorials/my-ros2-stack.md": "tests/ros does all of it",
    "docs/guides/github-actions.md": "test_ci_guides.py: pipelines fit GitHub's schema",
    "docs/guides/gitlab.md": "test_ci_guides.py: pipelines fit GitLab's schema",
    "docs/guides/jenkins.md": "test_ci_guides.py",
    "docs/guides/pre-commit.md": "test_ci_guides.py: pre-commit reads them",
    "docs/guides/extends.md": "test_extends_guide.py does all of it",
    "docs/reference/language.md": "made of docstrings, whose examples tests/unit/cli/test_catalog.py validates",
}
NOT_RUN = {
    "": "a drawing, or what a command prints",
    "text": "what a command prints, or a program of ROS",
    "lua": "an editor's own language; the schema that it names is tested",
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
"""Pages of which an indented block may hold no command."""
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
BESIDE = re.compile(r"""((?:"[^"]*"|'[^']*'|(?!\s\s|\s\#).)*)""")
"""A command up to what is said beside it, two blanks or a # away."""


class Block(NamedTuple):
    """A block of a page: where it begins, its language ("indented" where it has no fence), and its text."""

    page: str
    line: int
    language: str
    text: str


def blocks() -> Iterator[Block]:
    for page in PAGES:
        name, text = page.relative_to(ROOT).as_posix(), page.read_text(encoding="utf-8")
        for match in FENCED.finditer(text):
            yield Block(name, text[: match.start()].count("\n") + 1, match[2], match[3])
        bare = FENCED.sub(lambda match: re.sub(r"[^\n]", "", match[0]), text)
        for match in INDENTED.finditer(bare):
            yield Block(name, bare[: match.start()].count("\n") + 1, "indented", match[0])


BLOCKS = [block for block in blocks() if block.page not in OWN_TESTS]


def of(*languages: str) -> list[object]:
    chosen = [block for block in BLOCKS if block.language in languages]
    return [pytest.param(block, id=f"{block.page}:{block.line}") for block in chosen]


def commands(block: Block) -> list[str]:
    """The lines that somebody would type, without what is said beside them."""
    lines = [PROGRAM.match(line.strip()) for line in block.text.splitlines()]
    return [BESIDE.match(line[1])[1] for line in lines if line]


@pytest.mark.parametrize("block", of("console", "sh", "indented"))
def test_shown_command_is_valid(block: Block) -> None:
    typed = commands(block)
    assert typed or block.page in NO_COMMANDS or "= short test summary" in block.text
    for line in typed:
        for part in line.split(" && "):
            program, *words = shlex.split(part)
            if program == "simscen":
                understood(words)
            elif program == "make" and words:
                assert re.search(rf"^{words[0]}:.*## ", (ROOT / "Makefile").read_text(), re.MULTILINE)


def understood(words: list[str]) -> None:
    """Raises click's UsageError where simscen would."""
    command: click.Command = typer.main.get_command(app)
    context = command.make_context("simscen", list(words))
    while isinstance(command, click.Group):
        name, found, words = command.resolve_command(context, [*context.protected_args, *context.args])
        assert found is not None
        command, context = found, found.make_context(name, list(words), parent=context)


@pytest.mark.parametrize("block", [each for each in of("yaml") if "simscen: 1" not in each.values[0].text])
def test_partial_yaml_block_is_valid(block: Block, tmp_path: Path) -> None:
    """Of a scenario, which a base may hold any part of; of a robot, a stack, or the user's configuration."""
    if block.page == "docs/guides/temporal-criteria.md":
        pytest.skip("test_temporal_guide.py")
    if re.search(r"^stacks:", block.text, re.MULTILINE):
        (tmp_path / "config.yaml").write_text(block.text)
        assert load_config(tmp_path / "config.yaml").spec.stacks
        return
    kind = "robot" if block.text.startswith("urdf:") else "base"
    file = tmp_path / f"a.{kind}.yaml"
    file.write_text(f"simscen: 1\n{block.text}" if kind == "robot" else block.text)
    (tmp_path / "masks").mkdir()
    wrong = [str(problem) for problem in check_file(kind, file, tmp_path)]
    # A robot's file is shown in part, and the files that it names are those of a manufacturer.
    assert [told for told in wrong if kind == "base" or not re.search("missing key|no such file", told)] == []


@pytest.mark.parametrize("block", of("python", "json", "toml"))
def test_python_json_and_toml_blocks_can_be_parsed(block: Block) -> None:
    match block.language:
        case "python":
            compile(block.text, block.page, "exec")
        case "json":
            json.loads(block.text)
        case "toml":
            tomllib.loads(block.text)


def test_every_block_is_tested_or_has_a_reason() -> None:
    looked_at = {"console", "sh", "indented", "yaml", "python", "json", "toml"}
    assert {block.language for block in BLOCKS} - looked_at <= set(NOT_RUN)
    assert {page for page in OWN_TESTS if not (ROOT / page).is_file()} == set()
