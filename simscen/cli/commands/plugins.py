"""Command `simscen plugins`, which lists the types that installed packages add."""

import inspect
import json
import shutil
import sys
import textwrap
from itertools import groupby
from typing import Annotated, Any

import typer

from simscen.cli.diagnostics import escaped, print_json, print_text
from simscen.cli.shared_options import TextOrJson
from simscen.core.errors import Exit
from simscen.spec.registry import (
    ENTRY_POINT_PREFIX,
    GROUPS,
    BrokenPlugin,
    RegisteredType,
    plugin_types,
    types_without_group,
)

INDENT = 6
"""Number of spaces before the description of a type."""


def command(format_: Annotated[TextOrJson, typer.Option("--format", help="Output format.")] = TextOrJson.TEXT) -> None:
    """List the types that installed packages add.

    Lists the types by package, each with its kind, its name in files, its class, and the first paragraph of the
    docstring, or the reason why the type cannot be used. The command imports each type. Exit code 0: all types are
    usable; 3: a type cannot be used.
    """
    found = [entry for kind in GROUPS for entry in plugin_types(kind)]
    by_package = sorted([*found, *types_without_group()], key=lambda one: (one.distribution.lower(), one.distribution))
    listed = [_row(entry) for entry in by_package]
    if format_ is TextOrJson.JSON:
        print_json(json.dumps({"plugins": listed}, indent=2, ensure_ascii=False))
    else:
        print_text(_text(listed))
    sys.exit(Exit.INCOMPLETE if any(row["broken"] for row in listed) else Exit.PASSED)


def _row(entry: RegisteredType) -> dict[str, Any]:
    """Return the JSON data of one type. The key `broken` has the reason why the type cannot be used; "" if it can."""
    text, broken, hint = "", "", ""
    try:
        first_paragraph = inspect.cleandoc(entry.load().__doc__ or "").partition("\n\n")[0]
        text = " ".join(first_paragraph.split())
    except BrokenPlugin as error:
        broken, hint = error.reason, error.hint
    return {
        "kind": entry.group,
        "name": entry.name,
        "package": entry.distribution,
        "version": entry.version,
        "folder": entry.folder,
        "class": entry.value,
        "text": text,
        "broken": broken,
        "hint": hint if "simscen plugins" not in hint else "",  # not the hint to run this command
    }


def _text(listed: list[dict[str, Any]]) -> str:
    if not listed:
        return f"no plug-ins: no other package has entry points in a group `{ENTRY_POINT_PREFIX}…`"
    lines = []
    packages = groupby(listed, lambda row: (row["package"], row["version"], row["folder"]))
    for (package, version, folder), rows in packages:
        lines.append(escaped(f"{package} {version} ({folder})".replace("  ", " ")))
        lines += [line for row in rows for line in _lines(row)]
    return "\n".join(lines)


def _lines(row: dict[str, Any]) -> list[str]:
    width = max(40, min(100, shutil.get_terminal_size().columns))
    sign = "✗" if row["broken"] else "✓"
    text = f"cannot be used: {row['broken']}" if row["broken"] else row["text"]
    head = "  " + escaped(f"{sign} {row['kind']} {row['name']} ({row['class']})")
    more = [escaped(each) for each in (text, row["hint"]) if each]
    wrapped = [textwrap.wrap(text, width, initial_indent=" " * INDENT, subsequent_indent=" " * INDENT) for text in more]
    return [head, *(line for lines in wrapped for line in lines)]
