"""Command `simscen bench nav`, which measures the navigation of the reference stack."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.cli.benchmarks.results import FormatOption
from simscen.cli.diagnostics import as_text as problems_as_text
from simscen.cli.diagnostics import escaped, paths_from_working_folder, print_text, relative_to_working_folder
from simscen.cli.shared_options import ResumeOption, TextOrJson
from simscen.core.errors import Exit, NothingSelected
from simscen.report.display_text import detect_style

if TYPE_CHECKING:
    from simscen.bench.navigation.experiments import Experiment


def command(
    barn: Annotated[
        Path | None, typer.Option(help="Folder with BARN worlds and their scenarios.csv; without it, they are skipped.")
    ] = None,
    nav2: Annotated[
        Path | None,
        typer.Option(help="Folder with Nav2's TurtleBot3 sandbox (worlds, map, models); without it, it is skipped."),
    ] = None,
    project: Annotated[Path, typer.Option(help="Folder that contains simscen's scenarios/ and worlds/.")] = Path(),
    only: Annotated[
        list[str] | None, typer.Option(help="Select experiments by a part of their name; repeatable.")
    ] = None,
    first: Annotated[
        int, typer.Option(min=1, max=1_000_000, help="Number of the first field, building, drive, and seed.")
    ] = 1,
    seeds: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=1000,
            help="Number of seeds of BARN (default: 5), Nav2's system test, corner cases, and localization (20).",
        ),
    ] = None,
    fields: Annotated[
        int, typer.Option(min=0, max=10_000, help="Number of generated obstacle fields; half as many narrow fields.")
    ] = 50,
    dynamic: Annotated[
        int, typer.Option(min=0, max=10_000, help="Number of fields of moving cylinders at each speed.")
    ] = 20,
    goals: Annotated[
        int,
        typer.Option(
            min=1,
            max=10_000,
            help="Number of random goals in each shipped world, and number of generated buildings, ramps, and "
            "corridors; degraded sensing: a quarter of this number.",
        ),
    ] = 20,
    lost: Annotated[
        int,
        typer.Option(
            min=0,
            max=10_000,
            help="Number of drives with a wrong start, of drives with an unknown start, and of kidnappings.",
        ),
    ] = 50,
    stack: Annotated[
        Path | None,
        typer.Option(
            help="Repeat every drive with the parameters of a *.stack.yaml or Nav2 parameter file, and compare."
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", "-j", min=1, max=256, help="Number of parallel runs; default: one per core."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="New or empty output folder.")] = None,
    resume: ResumeOption = None,
    format_: FormatOption = TextOrJson.TEXT,
) -> None:
    """Measure the navigation of the reference stack, and print one line per experiment.

    The experiments are: BARN; generated fields (obstacle fields similar to those of BARN); narrow fields; dynamic
    fields (moving cylinders); random goals in shipped worlds and generated buildings; degraded sensing; ramps; two
    robots in a corridor; tb3_sandbox (Nav2's system test); corner cases; and localization. Confidence intervals are
    computed by bootstrap over worlds. The worlds of BARN and Nav2 are not included; pass their folders as options.
    Experiments without data are skipped with a message. Failed runs are printed on standard error, each with a command
    to repeat the run. An interrupted session prints its results so far; use --resume with the same options to continue.

    Exit code 0: all runs were completed; 3: a run could not be completed; 5: no experiment that matches --only has
    runs.
    """
    from simscen.bench.navigation.summary import compare_experiment
    from simscen.cli.benchmarks.navigation_experiments import Sizes, experiment_groups
    from simscen.cli.benchmarks.navigation_runs import execute_experiments, finished_trials, summarize_experiment
    from simscen.cli.benchmarks.navigation_table import as_json, as_text
    from simscen.cli.session.scenario_session import open_output_folder

    folder, journal = open_output_folder(out, resume)
    generated = folder / "generated"
    generated.mkdir(exist_ok=True)
    experiments: list[Experiment] = []
    sizes = Sizes(first, seeds, fields, dynamic, goals, lost)
    for group in experiment_groups(barn, nav2, project, generated, sizes):
        is_group_selected = _is_selected(group.name, only)
        if not is_group_selected and not any(_is_selected(name, only) for name in group.other_names):
            continue
        if group.missing_message:
            print(f"{group.name}: skipped, {group.missing_message}", file=sys.stderr)
            continue
        experiments += [
            experiment
            for experiment in group.write_experiments()
            if experiment.drives and (is_group_selected or _is_selected(experiment.name, only))
        ]
    if not experiments:
        raise NothingSelected(
            "nothing to run: no experiment matches --only, or those that match have no data, fields, or drives"
        )
    with_stack = [] if stack is None else experiments_with_stack(stack, experiments, generated, project)
    all_experiments = [*experiments, *with_stack]
    trials, stopped = execute_experiments(all_experiments, journal, workers or len(os.sched_getaffinity(0)))
    rows = [
        summarize_experiment(experiment, finished)
        for experiment, runs in zip(all_experiments, trials, strict=True)
        if (finished := finished_trials(runs))
    ]
    compared = zip(experiments if with_stack else [], trials, trials[len(experiments) :], strict=False)
    comparisons = [
        compare_experiment(experiment.name, before, after)
        for experiment, before, after in compared
        if finished_trials(before) and finished_trials(after)
    ]
    columns = detect_style(sys.stdout, os.environ).columns
    print_text(as_json(rows, comparisons) if format_ is TextOrJson.JSON else as_text(rows, comparisons, columns))
    if stopped:
        count = f"{sum(len(finished_trials(runs)) for runs in trials)} of {sum(map(len, trials))} runs"
        print_text(f"simscen: interrupted: {count}; continue with --resume {escaped(str(folder))}", sys.stderr)
        sys.exit(stopped)
    if any(row.tally.errors for row in rows):
        sys.exit(Exit.INCOMPLETE)


def experiments_with_stack(
    file: Path, experiments: list["Experiment"], generated: Path, project: Path
) -> list["Experiment"]:
    """Return copies of the experiments that use the parameters of a stack file. Raises InvalidInput.

    The scenarios of the copies are written to the folder `generated`. `project` is the root folder of the stack file.
    """
    from simscen.bench.navigation.experiments import with_stack_parameters
    from simscen.loading.stacks.stack_files import load_stack_file

    with paths_from_working_folder(project):
        choice = load_stack_file(file.name.split(".")[0], str(file), file, project)
    if choice.notes:
        print_text(problems_as_text(relative_to_working_folder(choice.notes, project)), sys.stderr)
    parameters = choice.section.plain if choice.section else {}
    return [
        with_stack_parameters(
            experiment, f"{experiment.name}, {choice.name}", parameters, generated / "with_stack" / str(number)
        )
        for number, experiment in enumerate(experiments)
    ]


def _is_selected(name: str, only: list[str] | None) -> bool:
    """Return whether --only selects the name of an experiment or group."""
    return not only or any(part.casefold() in name.casefold() for part in only)
