"""Command `simscen falsify`, which searches for values with which a scenario fails."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import escaped, print_text
from simscen.cli.session.backends import workers_and_cluster
from simscen.cli.session.falsification import FalsifyRequest, execute_search, summary_lines
from simscen.cli.shared_options import (
    AddressOption,
    BackendName,
    BackendOption,
    Format,
    FormatOption,
    JobsOption,
    JunitFamily,
    JunitFamilyOption,
    JunitOption,
    LenientOption,
    OutOption,
    OutputOptions,
    RootOption,
    StackOption,
    WallLimitOption,
    WorldPathOption,
)
from simscen.core.errors import UsageError
from simscen.run.kept_files import OutcomeFilter
from simscen.run.sessions.run_session import SessionOptions
from simscen.run.sessions.search import SearchMethod


def command(
    file: Annotated[
        Path, typer.Argument(help="A scenario with `sampled` variations.", autocompletion=completions.scenarios)
    ],
    method: Annotated[
        SearchMethod,
        typer.Option(
            help="tpe: learns where margins are small (needs Optuna: pip install optuna); sobol: covers the "
            "ranges evenly; random: independent draws; auto: tpe if Optuna is installed, otherwise sobol."
        ),
    ] = SearchMethod.AUTO,
    failures: Annotated[
        int, typer.Option(min=1, max=1000, help="Number of different failures after which the search stops.")
    ] = 1,
    runs: Annotated[int, typer.Option(min=1, max=1_000_000, help="Maximum number of runs.")] = 200,
    probability: Annotated[
        float | None,
        typer.Option(
            min=1e-6,
            max=0.5,
            help="With --method random: stop when the failure rate is at most this value with 95 % confidence.",
        ),
    ] = None,
    search_seed: Annotated[
        int, typer.Option(min=1, max=2**32 - 1, help="Seed of the search; the runs keep the seed of the scenario.")
    ] = 1,
    seed: Annotated[
        int | None, typer.Option(min=1, max=2**32 - 1, help="Use this seed instead of the scenario's own.")
    ] = None,
    out: OutOption = None,
    workers: JobsOption = None,
    backend: BackendOption = BackendName.LOCAL,
    address: AddressOption = None,
    junit: JunitOption = None,
    junit_family: JunitFamilyOption = JunitFamily.SIMSCEN,
    format_: FormatOption = Format.TEXT,
    wall_limit: WallLimitOption = 300.0,
    stack: StackOption = None,
    root: RootOption = None,
    world_path: WorldPathOption = None,
    lenient: LenientOption = False,
) -> None:
    """Search the ranges of a scenario for values with which it fails.

    With `tpe`, the search prefers values for which the criteria have small margins. The command writes each new kind
    of failure beside the file as a scenario NAME.failure-N.scenario.yaml. Two failures are of different kinds if they
    differ in the failed criteria, in the triggered events and faults, or in the place of the failure. The result does
    not depend on the number of parallel runs.

    Exit code 0: no failure was found; 1: a failure was found; 2: an invalid scenario; 3: a run could not be completed,
    also if a failure was found; 5: the scenario is skipped; 6: no failure was found, but --runs are too few for
    --probability; 129, 130, and 143: interrupted.
    """
    if probability is not None and method is not SearchMethod.RANDOM:
        raise UsageError("--probability needs --method random: only random values show a rate")
    workers, cluster = workers_and_cluster(workers, backend, address)
    options = SessionOptions(workers, seed, wall_limit=wall_limit, replay=OutcomeFilter.FAILED, cluster=cluster)
    request = FalsifyRequest(
        file,
        method,
        failures,
        runs,
        probability,
        search_seed,
        options,
        root,
        world_path or [],
        lenient,
        stack,
        OutputOptions(out, None, junit, junit_family, format_, False),
    )
    code, falsification = execute_search(request)
    if format_ is not Format.JSON:
        print_text("\n".join(escaped(line) for line in summary_lines(falsification)))
    sys.exit(code)
