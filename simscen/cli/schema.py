"""`simscen schema`."""

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.diagnostics import print_text
from simscen.cli.jsonschema import MODELS, as_text, schema_of


class Kind(str, Enum):
    """Kinds of files that have a schema."""

    SCENARIO = "scenario"
    WORLD = "world"
    ROBOT = "robot"


def command(
    kind: Annotated[Kind, typer.Argument(help="Of which kind of file.")] = Kind.SCENARIO,
    write: Annotated[Path | None, typer.Option(help="Write all of them into this folder instead.")] = None,
) -> None:
    """Print or write the JSON Schemas that editors use.

    Put `# yaml-language-server: $schema=<path>/scenario.schema.json` on the first line of a scenario to get completion
    and checks while typing.
    """
    if write is None:
        print_text(as_text(schema_of(kind.value)).rstrip())
        return
    write.mkdir(parents=True, exist_ok=True)
    for name in MODELS:
        file = write / f"{name}.schema.json"
        file.write_text(as_text(schema_of(name)), encoding="utf-8")
        print_text(str(file))
