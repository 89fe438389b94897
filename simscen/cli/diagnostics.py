"""Problems as people, editors and continuous integration read them."""

import json
import os
import re
import sys
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any, TextIO

from simscen.core.problems import Problem
from simscen.report.checkout import in_checkout
from simscen.report.text import ascii_only, no_marker, no_marker_in_json, one_line, width

MOST_A_FILE = 50
WIDEST = 100

_WORD = r"(?:[^\s,\]\}\[\{:#]|:(?=\S)|(?<=\S)#)+"
_TOKEN = re.compile(rf"""'(?:[^']|'')*'|"(?:[^"\\]|\\.)*"|-(?=\s)|{_WORD}(?: +{_WORD})*""")
"""A scalar as it is written: quoted, or words up to the next sign that means something to YAML."""
_WORKFLOW_COMMAND = re.compile(r"^(\s*):(?=:)", re.MULTILINE)


def from_here(problems: Iterable[Problem], root: Path) -> list[Problem]:
    """The problems with paths relative to the working folder, so that terminals and editors can open them."""
    return [replace(problem, path=_from_here(problem.path, root)) for problem in problems]


def as_text(problems: Sequence[Problem]) -> str:
    """Each with its line, a caret below the place, and a hint; at most 50 of a file."""
    blocks = []
    for path, group in groupby(problems, key=lambda problem: problem.path):
        found = list(group)
        blocks += [_block(problem) for problem in found[:MOST_A_FILE]]
        if len(found) > MOST_A_FILE:
            blocks.append(f"{harmless(path)}: … and {len(found) - MOST_A_FILE} more")
    return "\n".join(blocks)


def as_json(problems: Iterable[Problem], **more: Any) -> str:
    """One JSON object: `problems`, and whatever else is given."""
    keys = ("path", "line", "col", "code", "severity", "message", "hint")
    listed = [{key: getattr(problem, key) for key in keys} for problem in problems]
    return no_marker_in_json(json.dumps({**more, "problems": listed}, indent=2))


def as_github(problems: Iterable[Problem]) -> str:
    """Workflow commands that GitHub turns into annotations on the changed lines."""
    return "\n".join(_annotation(problem) for problem in problems)


def harmless(text: str) -> str:
    """Foreign text on one line that no terminal and no CI system obeys.

    GitHub runs `::command::` at the start of a line; a backslash keeps it from that.
    """
    return no_marker(_WORKFLOW_COMMAND.sub(r"\1:\\", one_line(text)))


def print_text(text: str, stream: TextIO | None = None) -> None:
    """Print on a stream of any encoding."""
    out = sys.stdout if stream is None else stream
    try:
        text.encode(out.encoding or "ascii")
    except UnicodeEncodeError:
        text = ascii_only(text)
    print(text, file=out)


def _block(problem: Problem) -> str:
    head = f"{harmless(problem.place)}: {problem.severity}[{problem.code}] {harmless(problem.message)}"
    lines = [head, *(_excerpt(problem) if problem.source.strip() and problem.line else [])]
    if problem.hint:
        margin = " " * (len(str(problem.line)) + 5)
        lines.append(
            textwrap.fill(
                harmless(problem.hint),
                WIDEST,
                initial_indent=f"{margin}= ",
                subsequent_indent=f"{margin}  ",
                break_long_words=False,
            )
        )
    return "\n".join(lines)


def _excerpt(problem: Problem) -> list[str]:
    """The line and a caret under the key or value; a long line is cut around it."""
    source, start = problem.source.replace("\t", " "), max(problem.col - 1, 0)
    token = _TOKEN.match(source, start)
    length = len(token[0]) if token else 1
    first = max(0, start - WIDEST // 2) if len(source) > WIDEST else 0
    shown = source[first : first + WIDEST].rstrip()
    length = max(1, min(length, len(shown) - (start - first)))
    before, marked = shown[: start - first], shown[start - first : start - first + length]
    gutter = " " * (len(str(problem.line)) + 4)
    carets = " " * width(before) + "^" * max(1, width(marked))
    return [f"    {problem.line} | {_kept(shown)}", f"{gutter} | {carets}"]


def _kept(source: str) -> str:
    """A line of the file with its spaces as they are; it follows a number and a bar, so it begins no line."""
    return no_marker(source)


def _annotation(problem: Problem) -> str:
    level = "error" if problem.severity == "error" else "warning"
    where = f"file={_property(in_checkout(problem.path))}"
    if problem.line:
        where += f",line={problem.line},col={problem.col}"
    message = problem.message + (f"\n{problem.hint}" if problem.hint else "")
    return f"::{level} {where},title={_property(f'simscen {problem.code}')}::{_data(message)}"


def _data(text: str) -> str:
    return no_marker(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


def _from_here(path: str, root: Path) -> str:
    """Relative to the working folder, or absolute where that is shorter; what is not there stays as it was given."""
    absolute = str(root.absolute() / path)
    return min(os.path.relpath(absolute), absolute, key=len) if os.path.lexists(absolute) else path
