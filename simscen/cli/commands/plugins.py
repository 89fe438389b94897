"""`simscen plugins`."""

import inspect
import json
import shutil
import sys
import textwrap
from enum import Enum
from itertools import groupby
from typing import Annotated, Any

import typer

from simscen.cli.diagnostics import harmless, print_text
from simscen.core.errors import Exit
from simscen.spec.registry import GROUPS, PREFIX, BrokenPlugin, Entry, installed, unknown_groups

INDENT = 6


class Format(str, Enum):
    """What to print."""

    TEXT = "text"
    JSON = "json"


def command(format_: Annotated[Format, typer.Option("--format", help="What to print.")] = Format.TEXT) -> None:
    """List the types that installed packages add to the language and to the stack.

    Package by package: the kind, the name that files use, the class, and the first sentence of its documentation; of
    one that cannot be used, why. Each is imported to be listed, as it is when a file uses it. Exit code 0: all can be
    used; 3: one cannot.
    """
    listed = [_row(entry) for entry in _everything()]
    if format_ is Format.JSON:
        print(json.dumps({"plugins": listed}, indent=2, ensure_ascii=False))
    else:
        print_text(_text(listed))
    sys.exit(Exit.INCOMPLETE if any(row["broken"] for row in listed) else Exit.PASSED)


def _everything() -> list[Entry]:
    """By package; of a package kind by kind, in the order of the language."""
    found = [entry for kind in GROUPS for entry in installed(kind)]
    return sorted([*found, *unknown_groups()], key=lambda entry: (entry.distribution.lower(), entry.distribution))


def _row(entry: Entry) -> dict[str, Any]:
    text, broken, hint = "", "", ""
    try:
        text = _first_sentence(inspect.cleandoc(entry.load().__doc__ or ""))
    except BrokenPlugin as error:
        broken, hint = error.why, error.hint
    return {
        "kind": entry.group,
        "name": entry.name,
        "package": entry.distribution,
        "version": entry.version,
        "folder": entry.folder,
        "class": entry.value,
        "text": text,
        "broken": broken,
        "hint": hint if "simscen plugins" not in hint else "",
    }


def _first_sentence(text: str) -> str:
    return " ".join(text.partition("\n\n")[0].split())


def _text(listed: list[dict[str, Any]]) -> str:
    if not listed:
        return f"no installed package adds anything: none has entry points in a group `{PREFIX}…`"
    lines = []
    for (package, version, folder), rows in groupby(
        listed, lambda row: (row["package"], row["version"], row["folder"])
    ):
        lines.append(harmless(f"{package} {version} ({folder})".replace("  ", " ")))
        lines += [line for row in rows for line in _lines(row)]
    return "\n".join(lines)


def _lines(row: dict[str, Any]) -> list[str]:
    width = max(40, min(100, shutil.get_terminal_size().columns))
    sign = "✗" if row["broken"] else "✓"
    told = f"cannot be used: {row['broken']}" if row["broken"] else row["text"]
    head = "  " + harmless(f"{sign} {row['kind']} {row['name']} ({row['class']})")
    more = [harmless(text) for text in (told, row["hint"]) if text]
    wrapped = [textwrap.wrap(text, width, initial_indent=" " * INDENT, subsequent_indent=" " * INDENT) for text in more]
    return [head, *(line for lines in wrapped for line in lines)]
