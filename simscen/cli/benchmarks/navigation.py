"""`simscen bench nav`: how well the reference stack drives."""

import os
import sys
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.cli.diagnostics import as_text as problems_as_text
from simscen.cli.diagnostics import escaped, from_here, print_text
from simscen.core.errors import Exit, NothingSelected
from simscen.report.styled_line import detect_style

if TYPE_CHECKING:
    from simscen.bench.navigation.experiments import Experiment


class Format(str, Enum):
    """What is printed."""

    TEXT = "text"
    JSON = "json"


def command(
    barn: Annotated[
        Path | None, typer.Option(help="Folder with worlds of BARN and their scenarios.csv; none: skipped.")
    ] = None,
    nav2: Annotated[
        Path | None, typer.Option(help="Folder with Nav2's TurtleBot3 sandbox: worlds, map, models; none: skipped.")
    ] = None,
    project: Annotated[Path, typer.Option(help="Folder with simscen's scenarios/ and worlds/.")] = Path(),
    only: Annotated[list[str] | None, typer.Option(help="Part of the name of experiments; repeatable.")] = None,
    first: Annotated[
        int, typer.Option(min=1, max=1_000_000, help="The number of the first field, building, drive and seed.")
    ] = 1,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=1000, help="Seeds of each scenario; default: 5 for BARN, else 20.")
    ] = None,
    fields: Annotated[
        int, typer.Option(min=0, max=10_000, help="How many obstacle fields to generate; narrow ones: half as many.")
    ] = 50,
    dynamic: Annotated[
        int, typer.Option(min=0, max=10_000, help="How many fields of moving cylinders at each speed.")
    ] = 20,
    goals: Annotated[
        int, typer.Option(min=1, max=10_000, help="How many random goals in each world, ramps, corridors.")
    ] = 20,
    lost: Annotated[int, typer.Option(min=0, max=10_000, help="How often the robot does not know where it is.")] = 50,
    stack: Annotated[
        Path | None,
        typer.Option(
            help="A *.stack.yaml, or a parameter file of Nav2: every drive once more with its parameters on top, and "
            "what that changes."
        ),
    ] = None,
    workers: Annotated[int | None, typer.Option("--workers", "-j", min=1, max=256, help="Default: all cores.")] = None,
    out: Annotated[Path | None, typer.Option(help="Output folder, new or empty.")] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Go on in this output folder: only runs that have no verdict yet.")
    ] = None,
    format_: Annotated[Format, typer.Option("--format", help="Output format.")] = Format.TEXT,
) -> None:
    """Measure how well the reference stack drives, and print one line for each experiment.

    BARN and fields like it, narrow fields, fields of moving cylinders, random goals in shipped worlds and generated
    buildings, sensors that fail, ramps, two robots in a corridor, Nav2's own system test, corner cases and
    localization. Intervals are by bootstrap over worlds. Worlds of BARN and Nav2 are no part of simscen: say where you
    have them. What is not there is skipped, which is said on standard error, as is every run that did not come out
    well, with the command that repeats it. Interrupted, it prints what there is by then; with the same options and
    --resume it goes on. Exit code 0, or 3 when a run could not be completed.
    """
    from simscen.bench.navigation.summary import compare_drives
    from simscen.cli.benchmarks.navigation_experiments import Sizes, available_experiments
    from simscen.cli.benchmarks.navigation_runs import drive, driven, measured
    from simscen.cli.benchmarks.navigation_table import as_json, as_text
    from simscen.cli.session.run_session import output_folder

    folder, journal = output_folder(out, resume)
    made = folder / "generated"
    made.mkdir(exist_ok=True)
    experiments: list[Experiment] = []
    for offer in available_experiments(barn, nav2, project, made, Sizes(first, seeds, fields, dynamic, goals, lost)):
        whole = _named(offer.name, only)
        if not whole and not any(_named(name, only) for name in offer.parts):
            continue
        if offer.missing:
            print(f"{offer.name}: skipped, {offer.missing}", file=sys.stderr)
            continue
        experiments += [each for each in offer.make() if whole or _named(each.name, only)]
    if not experiments:
        raise NothingSelected("no experiment is called so, or its data is not here")
    others = [] if stack is None else with_stack(stack, experiments, made, project)
    all_of_them = [*experiments, *others]
    trials, stopped = drive(all_of_them, journal, workers or len(os.sched_getaffinity(0)))
    rows = [measured(one, done) for one, runs in zip(all_of_them, trials, strict=True) if (done := driven(runs))]
    pairs = [
        compare_drives(one.name, before, after)
        for one, before, after in zip(experiments if others else [], trials, trials[len(experiments) :], strict=False)
        if driven(before) and driven(after)
    ]
    columns = detect_style(sys.stdout, os.environ).columns
    print_text(as_json(rows, pairs) if format_ is Format.JSON else as_text(rows, pairs, columns))
    if stopped:
        count = f"{sum(len(driven(runs)) for runs in trials)} of {sum(map(len, trials))} runs"
        print_text(f"simscen: interrupted: {count}; go on with --resume {escaped(str(folder))}", sys.stderr)
        sys.exit(stopped)
    if any(row.tally.errors for row in rows):
        sys.exit(Exit.INCOMPLETE)


def with_stack(file: Path, experiments: list["Experiment"], made: Path, project: Path) -> list["Experiment"]:
    """The same experiments with the parameters of a stack file. Raises InvalidInput."""
    from simscen.bench.navigation.experiments import with_stack_parameters
    from simscen.loading.stacks.stackfile import load_stack_file

    choice = load_stack_file(file.name.split(".")[0], str(file), file, project)
    if choice.notes:
        print_text(problems_as_text(from_here(choice.notes, project)), sys.stderr)
    said = choice.section.plain if choice.section else {}
    return [
        with_stack_parameters(one, f"{one.name}, {choice.name}", said, made / "with_stack" / str(number))
        for number, one in enumerate(experiments)
    ]


def _named(name: str, only: list[str] | None) -> bool:
    return not only or any(part.casefold() in name.casefold() for part in only)
