"""`simscen schema`."""

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.diagnostics import harmless, print_text
from simscen.cli.session.output_files import save
from simscen.core.version import PACKAGE
from simscen.spec.registry import GROUPS, installed


class Kind(str, Enum):
    """Kinds of files that have a schema."""

    SCENARIO = "scenario"
    WORLD = "world"
    ROBOT = "robot"
    STACK = "stack"
    CONFIG = "config"
    BASE = "base"


def command(
    kind: Annotated[Kind, typer.Argument(help="Of which kind of file.")] = Kind.SCENARIO,
    write: Annotated[Path | None, typer.Option(help="Write all of them into this folder instead.")] = None,
) -> None:
    """Print or write the JSON Schemas that editors use.

    Put `# yaml-language-server: $schema=<path>/scenario.schema.json` on the first line of a scenario to get completion
    and checks while typing. What installed packages add is in them, too.
    """
    if write is None:
        print_text(text_of(kind.value).rstrip())
        return
    for each in Kind:
        text = text_of(each.value)
        file = write / f"{each.value}.schema.json"
        save(file, lambda path, text=text: path.write_text(text, encoding="utf-8"))  # type: ignore[misc]
        print_text(harmless(str(file)))


def text_of(kind: str) -> str:
    """The schema, with what installed packages add; where they add nothing, as it was generated for this version.

    Making it anew imports every model.
    """
    if any(installed(group) for group in GROUPS):
        from simscen.cli.catalog.json_schema import as_text, schema_of

        return as_text(schema_of(kind, installed=True))
    return (PACKAGE / "data" / "schemas" / f"{kind}.schema.json").read_text(encoding="utf-8")
