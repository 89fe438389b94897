"""Output of problems (errors and warnings about files) as text, JSON, and GitHub annotations."""

import json
import os
import re
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any, TextIO

from simscen.core.errors import InvalidInput, Problem
from simscen.report.display_text import (
    ascii_only,
    display_width,
    encodable_json,
    escape_ci_markers,
    escape_ci_markers_in_json,
    one_line,
    relative_to_checkout,
)

MAX_PROBLEMS_PER_FILE = 50
"""Maximum number of problems of one file that are printed."""
MAX_COLUMNS = 100
"""Maximum width of a hint or of an excerpt of a source line, in characters."""

_WORD = r"(?:[^\s,\]\}\[\{:#]|:(?=\S)|(?<=\S)#)+"
_TOKEN = re.compile(rf"""'(?:[^']|'')*'|"(?:[^"\\]|\\.)*"|-(?=\s)|{_WORD}(?: +{_WORD})*""")
"""A YAML scalar: quoted, or words up to the next YAML indicator."""
_WORKFLOW_COMMAND = re.compile(r"^(\s*):(?=:)", re.MULTILINE)
"""Start of a GitHub workflow command, such as `::error`."""


def relative_to_working_folder(problems: Iterable[Problem], root: Path) -> list[Problem]:
    """Return the problems with paths relative to the working directory, or absolute paths if these are shorter.

    The paths of the given problems are relative to `root`.
    """
    return [replace(problem, path=_relative_path(problem.path, root)) for problem in problems]


@contextmanager
def paths_from_working_folder(root: Path) -> Iterator[None]:
    """Within the context, apply `relative_to_working_folder` to the problems in InvalidInput."""
    try:
        yield
    except InvalidInput as error:
        raise InvalidInput(relative_to_working_folder(error.problems, root)) from error


def as_text(problems: Sequence[Problem]) -> str:
    """Return the problems as text: for each problem, its place and message, the source line, carets, and the hint.

    The problems of one file must be adjacent. Only the first MAX_PROBLEMS_PER_FILE of a file are included.
    """
    blocks = []
    for path, group in groupby(problems, key=lambda problem: problem.path):
        found = list(group)
        blocks += [_problem_text(problem) for problem in found[:MAX_PROBLEMS_PER_FILE]]
        if len(found) > MAX_PROBLEMS_PER_FILE:
            blocks.append(f"{escaped(path)}: … and {len(found) - MAX_PROBLEMS_PER_FILE} more")
    return "\n".join(blocks)


def as_json(problems: Iterable[Problem], **further_keys: Any) -> str:
    """Return a JSON object with the problems under the key `problems`, and with `further_keys`."""
    keys = ("path", "line", "col", "code", "severity", "message", "hint")
    listed = [{key: getattr(problem, key) for key in keys} for problem in problems]
    return escape_ci_markers_in_json(json.dumps({**further_keys, "problems": listed}, indent=2))


def as_github(problems: Iterable[Problem]) -> str:
    """Return GitHub workflow commands that annotate the lines of the problems."""
    lines = []
    for problem in problems:
        level = "error" if problem.severity == "error" else "warning"
        place = f"file={_escape_property(relative_to_checkout(problem.path))}"
        if problem.line:
            place += f",line={problem.line},col={problem.col}"
        title = _escape_property(f"simscen {problem.code}")
        message = problem.message + (f"\n{problem.hint}" if problem.hint else "")
        lines.append(f"::{level} {place},title={title}::{_escape_message(message)}")
    return "\n".join(lines)


def escaped(text: str) -> str:
    """Return untrusted text as one line, with terminal control sequences and commands of CI systems escaped."""
    return escape_ci_markers(_WORKFLOW_COMMAND.sub(r"\1:\\", one_line(text)))


def print_text(text: str, stream: TextIO | None = None) -> None:
    """Print a text to a stream, by default stdout; in ASCII if the stream's encoding lacks one of its characters."""
    out = sys.stdout if stream is None else stream
    try:
        text.encode(out.encoding or "ascii")
    except UnicodeEncodeError:
        text = ascii_only(text)
    print(text, file=out)


def print_json(document: str) -> None:
    """Print a JSON document to stdout, with escapes for CI commands and for characters that stdout cannot encode."""
    print(encodable_json(escape_ci_markers_in_json(document), sys.stdout))


def _problem_text(problem: Problem) -> str:
    head = f"{escaped(problem.place)}: {problem.severity}[{problem.code}] {escaped(problem.message)}"
    lines = [head, *(_excerpt(problem) if problem.source.strip() and problem.line else [])]
    if problem.hint:
        margin = " " * (len(str(problem.line)) + 5)
        wrapper = textwrap.TextWrapper(MAX_COLUMNS, f"{margin}= ", f"{margin}  ", break_long_words=False)
        lines.append(wrapper.fill(escaped(problem.hint)))
    return "\n".join(lines)


def _excerpt(problem: Problem) -> list[str]:
    """Return two lines: the source line, and carets under the key or value. Long source lines are shortened."""
    source, start = problem.source.replace("\t", " "), max(problem.col - 1, 0)
    token = _TOKEN.match(source, start)
    length = len(token[0]) if token else 1
    first = max(0, start - MAX_COLUMNS // 2) if len(source) > MAX_COLUMNS else 0
    excerpt = source[first : first + MAX_COLUMNS].rstrip()
    length = max(1, min(length, len(excerpt) - (start - first)))
    before, marked = excerpt[: start - first], excerpt[start - first : start - first + length]
    gutter = " " * (len(str(problem.line)) + 4)
    carets = " " * display_width(before) + "^" * max(1, display_width(marked))
    return [f"    {problem.line} | {escape_ci_markers(excerpt)}", f"{gutter} | {carets}"]


def _escape_message(text: str) -> str:
    return escape_ci_markers(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escape_property(text: str) -> str:
    return _escape_message(text).replace(":", "%3A").replace(",", "%2C")


def _relative_path(path: str, root: Path) -> str:
    """Return `path` relative to the working directory, or absolute if that is shorter; unchanged for a missing file.

    `path` is relative to `root`.
    """
    absolute = str(root.absolute() / path)
    return min(os.path.relpath(absolute), absolute, key=len) if os.path.lexists(absolute) else path
