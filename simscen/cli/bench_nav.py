"""`simscen bench nav`: how well the reference stack drives."""

import os
import sys
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.core.errors import Exit, NothingSelected

if TYPE_CHECKING:
    from simscen.study.experiment import Experiment

DATA = Path("../shared/data")


class Format(str, Enum):
    """What is printed."""

    TEXT = "text"
    JSON = "json"


def command(
    barn: Annotated[Path, typer.Option(help="BARN's worlds, with their scenarios.csv.")] = DATA / "barn_sample",
    nav2: Annotated[Path, typer.Option(help="Nav2's TurtleBot3 sandbox.")] = DATA / "nav2_tb3_sandbox",
    project: Annotated[Path, typer.Option(help="Folder with simscen's scenarios/ and worlds/.")] = Path(),
    only: Annotated[list[str] | None, typer.Option(help="Part of an experiment's name; repeatable.")] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=1000, help="Seeds of each scenario; default: 5 for BARN, else 20.")
    ] = None,
    fields: Annotated[int, typer.Option(min=0, max=10_000, help="How many obstacle fields to generate.")] = 100,
    dynamic: Annotated[
        int, typer.Option(min=0, max=10_000, help="How many fields of moving cylinders at each speed.")
    ] = 20,
    lost: Annotated[int, typer.Option(min=0, max=10_000, help="How often the robot does not know where it is.")] = 50,
    workers: Annotated[int | None, typer.Option("--workers", "-j", min=1, max=256, help="Default: all cores.")] = None,
    out: Annotated[Path | None, typer.Option(help="Output folder, new or empty.")] = None,
    format_: Annotated[Format, typer.Option("--format", help="What to print.")] = Format.TEXT,
) -> None:
    """Measure how well the reference stack drives, and print one line for each experiment.

    BARN and fields like it, fields of moving cylinders, Nav2's own system test, corner cases and localisation, each
    over many seeds. What cannot be found is skipped, which is said on standard error, as is every run that did not come
    out well, with the command that repeats it. Exit code 0, or 3 when a run could not be completed.
    """
    from simscen.cli.bench_run import drive
    from simscen.cli.bench_table import as_json, as_text
    from simscen.run.outfolder import make_folder
    from simscen.study.experiments import (
        barn_challenge,
        corner_cases,
        dynamic_fields,
        generated_fields,
        localizations,
        sandbox,
    )

    folder = make_folder(out)
    made = folder / "generated"
    many = range(1, (seeds or 20) + 1)
    offers: dict[str, tuple[Path, Callable[[], list[Experiment]]]] = {
        "BARN": (barn, lambda: [barn_challenge(made, barn, range(1, (seeds or 5) + 1))]),
        "generated fields": (folder, lambda: [generated_fields(made, fields)] if fields else []),
        "dynamic fields": (folder, lambda: dynamic_fields(made, dynamic) if dynamic else []),
        "tb3_sandbox": (nav2, lambda: sandbox(made, nav2, many)),
        "corner cases": (project / "scenarios", lambda: corner_cases(project / "scenarios", project, many)),
        "localization": (project / "worlds", lambda: localizations(made, project / "worlds", many, lost)),
    }
    experiments: list[Experiment] = []
    for name, (needed, make) in offers.items():
        if not needed.is_dir():
            print(f"{name}: skipped, there is no folder {needed}", file=sys.stderr)
        elif _wanted(name, only) or name != "generated fields":  # those take a while to generate
            experiments += [made for made in make() if _wanted(name, only) or _wanted(made.name, only)]
    if not experiments:
        raise NothingSelected("no experiment is called so, or its data is not here")
    rows = drive(experiments, folder, workers or len(os.sched_getaffinity(0)))
    print(as_json(rows) if format_ is Format.JSON else as_text(rows))
    if any(row.tally.errors for row in rows):
        sys.exit(Exit.INCOMPLETE)


def _wanted(name: str, only: list[str] | None) -> bool:
    return not only or any(part.casefold() in name.casefold() for part in only)
