"""Command `simscen validate`, which checks files and prints their problems."""

import sys
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import as_github, as_json, as_text, print_text, relative_to_working_folder
from simscen.cli.session.file_checks import FileChecker
from simscen.cli.session.stacks import parse_stacks
from simscen.cli.shared_options import Format, RootOption, WorldPathOption
from simscen.core.errors import Exit, InvalidInput, Problem
from simscen.loading.checks.files import CHECKED_VARIATIONS, STACK_KINDS, check_file, file_kind
from simscen.loading.files.discovery import SUFFIXES, default_root, discover


def command(
    paths: Annotated[
        list[Path], typer.Argument(help="Files, or folders to search.", autocompletion=completions.yaml_files)
    ],
    format_: Annotated[Format, typer.Option("--format", help="Output format of problems.")] = Format.TEXT,
    stack: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Check scenarios with this stack, as in `simscen run`; repeatable."),
    ] = None,
    root: RootOption = None,
    world_path: WorldPathOption = None,
    lenient: Annotated[
        bool, typer.Option("--lenient", help="Report unsupported parts of SDF worlds as warnings instead of errors.")
    ] = False,
    fast: Annotated[bool, typer.Option("--fast", help="Skip checks that need the world or robot to be built.")] = False,
    picture: Annotated[
        Path | None, typer.Option(help="Write a picture of each scenario with a geometric problem into this folder.")
    ] = None,
) -> None:
    """Check scenario, world, robot, and stack files without running anything.

    Lists every problem with file, line, and column. Folders are searched for *.scenario.yaml, *.study.yaml,
    *.world.yaml, *.robot.yaml, *.stack.yaml, and *.base.yaml. A Nav2 parameter file is checked as a stack, and
    parameters that simscen does not use are listed. Base files and defaults.yaml may be incomplete. Scenarios are also
    checked in their worlds: whether start and goals are free, whether the robot can arrive in time, and whether an
    event, a fault, or a criterion is certainly impossible. Only the first 20 variations of a study are checked.

    Exit code 0: all files are valid; 2: a file is invalid; 5: no files found.
    """
    root_folder = root or default_root(paths)
    stacks = parse_stacks(stack or [], root_folder, world_path or [])
    checker = FileChecker(
        root_folder, world_path or [], lenient, fast, picture, stacks=stacks, requires_commands=bool(stack)
    )
    kinds, invalid_files, found = Counter[str](), 0, dict[Problem, None]()
    try:
        files = discover(paths, root_folder, SUFFIXES)
    except InvalidInput as error:
        if format_ is Format.TEXT:
            raise
        _print_problems(error.problems, format_, file_count=0, is_valid=False)
        sys.exit(Exit.USAGE)
    for file in files:
        kind = file_kind(file, root_folder)
        file_problems = relative_to_working_folder(_problems(kind, file, checker), root_folder)
        kinds[kind] += 1
        invalid_files += any(problem.severity == "error" for problem in file_problems)
        found.update(dict.fromkeys(file_problems))
    problems = list(found)
    _print_problems(problems, format_, kinds.total(), is_valid=not invalid_files)
    if format_ is not Format.JSON:
        print_text(_summary(kinds, problems, invalid_files))
    if invalid_files:
        sys.exit(Exit.USAGE)


def _print_problems(problems: list[Problem], format_: Format, file_count: int, is_valid: bool) -> None:
    if format_ is Format.JSON:
        print(as_json(problems, valid=is_valid, files=file_count))
    elif problems:
        print_text(as_github(problems) if format_ is Format.GITHUB else as_text(problems))


def _problems(kind: str, file: Path, checker: FileChecker) -> list[Problem]:
    """Return the problems of a file. A world or robot without errors in the text is also built and checked."""
    if kind in ("scenario", "study"):
        variation_numbers = CHECKED_VARIATIONS if kind == "study" else None
        checked = [checker.check_scenario(file, choice, variation_numbers) for choice in checker.choices]
        found = [problem for _, problems in checked for problem in problems]
        return list(dict.fromkeys(found))
    found = check_file(kind, file, checker.root, checker.world_path)
    if kind in (*STACK_KINDS, "base") or any(problem.severity == "error" for problem in found):
        return found
    check_built = checker.check_robot if kind == "robot" else checker.check_world
    return [*found, *check_built(file)]


def _summary(kinds: Counter[str], problems: list[Problem], invalid_files: int) -> str:
    """Return the last line of the output, such as "2 scenarios and 1 world are valid".

    `kinds` are the numbers of checked files by kind.
    """
    if invalid_files:
        errors = sum(problem.severity == "error" for problem in problems)
        return f"{_count(errors, 'problem')} in {invalid_files} of {_count(kinds.total(), 'file')}"
    counts = [_count(number, kind) for kind, number in kinds.items()]
    listed = " and ".join([", ".join(counts[:-1]), counts[-1]] if len(counts) > 1 else counts)
    return f"{listed} {'is' if kinds.total() == 1 else 'are'} valid"


def _count(number: int, kind: str) -> str:
    """Return a number with the plural of a kind of file, such as "2 studies"."""
    noun, separator, owner = kind.partition(" of ")  # a parameter file of Nav2
    plural = "studies" if noun == "study" else f"{noun}s"
    return f"{number} {noun if number == 1 else plural}{separator}{owner}"
