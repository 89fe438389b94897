"""`simscen new`."""

from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completing
from simscen.cli.diagnostics import harmless, print_text
from simscen.core.errors import UsageError
from simscen.core.version import PACKAGE
from simscen.loading.discovery import SCENARIO, default_root
from simscen.loading.messages import quoted, suggestion
from simscen.loading.scenario import load_scenario, unusable_name
from simscen.loading.source import reason


def command(
    name: Annotated[str, typer.Argument(help="A name or path, e.g. `aisle` for aisle.scenario.yaml.")],
    like: Annotated[
        str,
        typer.Option(
            metavar="SCENARIO",
            help="Copy this scenario, with what it needs: a file, or the name of a shipped one.",
            autocompletion=completing.shipped,
        ),
    ] = "",
) -> None:
    """Write a commented scenario to start from.

    It is valid and passes as it is. With `--like`, it is a copy of another scenario: the worlds, maps and robots that
    it names are copied into a folder of its name beside it, unless they are in the same project, and its paths lead
    there. A file that is there already is never overwritten.
    """
    last = name.rpartition("/")[2]
    if unusable_name(next((last.removesuffix(suffix) for suffix in SCENARIO if last.endswith(suffix)), last)):
        raise UsageError(f"{name!r} is no name for a scenario")
    file = Path(name if name.endswith(SCENARIO) else f"{name}{SCENARIO[0]}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.open("x").close()
    except FileExistsError:
        raise UsageError(f"{file} is there already; choose another name") from None
    except (OSError, ValueError) as error:
        why = reason(error) if isinstance(error, OSError) else "the name cannot be a path"
        raise UsageError(f"cannot write {name!r}: {why}") from None
    try:
        written = _copy(like, file) if like else _starter(file)
    except OSError as error:
        file.unlink(missing_ok=True)
        raise UsageError(f"cannot write {name!r}: {reason(error)}") from None
    except BaseException:
        file.unlink(missing_ok=True)
        raise
    for other in written[1:]:
        print_text(f"{harmless(str(other))} is written, too")
    print_text(f"{harmless(str(file))} is written; try: simscen run {harmless(str(file))}")


def _starter(file: Path) -> list[Path]:
    file.write_text((PACKAGE / "data" / "starter.scenario.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    return [file]


def _copy(like: str, file: Path) -> list[Path]:
    from simscen.loading.copying import copy_scenario

    source = _source(like)
    return copy_scenario(load_scenario(source, default_root([source])), file, default_root([file]))


def _source(like: str) -> Path:
    """The scenario that is meant. Raises UsageError."""
    from simscen.cli.shipped import shipped_scenarios

    if Path(like).is_file():
        return Path(like)
    shipped = shipped_scenarios()
    means = [path for name, path in shipped.items() if like in (name, name.rpartition("/")[2])]
    if len(means) == 1:
        return means[0]
    if means:
        names = [name for name, path in shipped.items() if path in means]
        raise UsageError(f"several shipped scenarios are called {quoted(like)}: {', '.join(names)}")
    hint = suggestion(like, shipped)
    raise UsageError(f"there is no file and no shipped scenario {quoted(like)}" + (f"; {hint}" if hint else ""))
