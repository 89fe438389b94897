"""Command `simscen schema`, which prints or writes the JSON Schemas for editors."""

from enum import Enum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.diagnostics import escaped, print_json, print_text
from simscen.cli.session.user_files import save
from simscen.core.version import PACKAGE
from simscen.spec.registry import GROUPS, plugin_types


class SchemaKind(str, Enum):
    """Kind of file that a schema describes."""

    SCENARIO = "scenario"
    WORLD = "world"
    ROBOT = "robot"
    STACK = "stack"
    CONFIG = "config"
    BASE = "base"


def command(
    kind: Annotated[SchemaKind, typer.Argument(help="Kind of file.")] = SchemaKind.SCENARIO,
    write: Annotated[Path | None, typer.Option(help="Write all schemas into this folder.")] = None,
) -> None:
    """Print or write the JSON Schemas that editors use.

    For completion and checks while typing, put `# yaml-language-server: $schema=<path>/scenario.schema.json` on the
    first line of a scenario. The schemas include the types of installed packages.
    """
    if write is None:
        print_json(schema_text(kind.value).rstrip())
        return
    for each in SchemaKind:
        text = schema_text(each.value)
        file = write / f"{each.value}.schema.json"
        save(file, partial(Path.write_text, data=text, encoding="utf-8"))
        print_text(escaped(str(file)))


def schema_text(kind: str) -> str:
    """Return the schema of a kind of file, with the types of installed packages. `kind` is a value of SchemaKind."""
    if any(plugin_types(group) for group in GROUPS):
        from simscen.cli.catalog.json_schema import as_text, schema_of

        return as_text(schema_of(kind, with_plugins=True))
    return (PACKAGE / "data" / "schemas" / f"{kind}.schema.json").read_text(encoding="utf-8")
