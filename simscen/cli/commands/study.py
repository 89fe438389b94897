"""Command `simscen study`, which runs one scenario many times."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.session.backends import workers_and_cluster
from simscen.cli.session.study_session import StudyRequest, execute_study
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
    KeepLogsOption,
    LenientOption,
    OpenOption,
    OutOption,
    OutputOptions,
    ReplayOption,
    ResumeOption,
    RootOption,
    StackOption,
    WallLimitOption,
    WorldPathOption,
)
from simscen.run.kept_files import LogRetention, OutcomeFilter
from simscen.run.sessions.run_session import SessionOptions


def command(
    file: Annotated[
        Path, typer.Argument(help="A *.scenario.yaml or *.study.yaml file.", autocompletion=completions.scenarios)
    ],
    runs: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=1_000_000,
            help="Number of random runs, or their maximum for a sequential claim; default: `runs` of `acceptance`, or "
            "`count` of `sampled`.",
        ),
    ] = None,
    repeat: Annotated[
        int, typer.Option(min=1, max=100_000, help="Number of seeds for each variation, if values are not random.")
    ] = 1,
    seed: Annotated[
        int | None, typer.Option(min=1, max=2**32 - 1, help="First seed, instead of the scenario's own.")
    ] = None,
    out: OutOption = None,
    resume: ResumeOption = None,
    workers: JobsOption = None,
    backend: BackendOption = BackendName.LOCAL,
    address: AddressOption = None,
    junit: JunitOption = None,
    junit_family: JunitFamilyOption = JunitFamily.SIMSCEN,
    format_: FormatOption = Format.TEXT,
    wall_limit: WallLimitOption = 300.0,
    stack: StackOption = None,
    open_: OpenOption = False,
    root: RootOption = None,
    world_path: WorldPathOption = None,
    replay: ReplayOption = OutcomeFilter.FAILED,
    keep_logs: KeepLogsOption = LogRetention.ALL,
    lenient: LenientOption = False,
) -> None:
    """Run one scenario many times: how often does it fail, and what makes it fail?

    With random seeds and random values (`sampled`), each run has its own seed and its own values, and `acceptance`
    states which pass rate must be shown. A sequential claim ends the study as soon as it is decided. With chosen values
    (`grid`, `pairwise`, `list`, `sobol`), the study shows which of them fail. Results do not depend on the number of
    parallel runs.

    Exit code 0: the claim holds, or all runs passed if there is no claim; 1: the claim is refuted, or a run failed; 2:
    an invalid scenario; 3: a run could not be completed; 5: the scenario is skipped; 6: the claim is undecided; 129,
    130, and 143: interrupted.
    """
    workers, cluster = workers_and_cluster(workers, backend, address)
    options = SessionOptions(workers, seed, wall_limit=wall_limit, replay=replay, keep_logs=keep_logs, cluster=cluster)
    request = StudyRequest(
        file,
        runs,
        repeat,
        options,
        root,
        world_path or [],
        lenient,
        stack,
        OutputOptions(out, resume, junit, junit_family, format_, open_),
    )
    sys.exit(execute_study(request))
