"""`simscen new`."""

from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.diagnostics import harmless, print_text
from simscen.core.errors import UsageError
from simscen.core.version import PACKAGE
from simscen.loading.discovery import SCENARIO
from simscen.loading.scenario import unusable_name
from simscen.loading.source import reason


def command(
    name: Annotated[str, typer.Argument(help="A name or path, e.g. `aisle` for aisle.scenario.yaml.")],
) -> None:
    """Write a commented scenario to start from.

    It is valid and passes as it is. A file that is there already is never overwritten.
    """
    last = name.rpartition("/")[2]
    if unusable_name(next((last.removesuffix(suffix) for suffix in SCENARIO if last.endswith(suffix)), last)):
        raise UsageError(f"{name!r} is no name for a scenario")
    file = Path(name if name.endswith(SCENARIO) else f"{name}{SCENARIO[0]}")
    starter = (PACKAGE / "data" / "starter.scenario.yaml").read_text(encoding="utf-8")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("x", encoding="utf-8") as out:
            out.write(starter)
    except FileExistsError:
        raise UsageError(f"{file} is there already; choose another name") from None
    except (OSError, ValueError) as error:
        why = reason(error) if isinstance(error, OSError) else "the name cannot be a path"
        raise UsageError(f"cannot write {name!r}: {why}") from None
    print_text(f"{harmless(str(file))} is written; try: simscen run {harmless(str(file))}")
