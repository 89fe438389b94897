"""Command `simscen run`, which executes a session or the watch mode."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.session.fork_server_start import early_fork_server
from simscen.cli.shared_options import (
    STACK_HELP,
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
    WallLimitOption,
    WorldPathOption,
)
from simscen.core.errors import UsageError
from simscen.run.kept_files import LogRetention, OutcomeFilter


def command(
    paths: Annotated[
        list[Path], typer.Argument(help="Scenario files, or folders to search.", autocompletion=completions.scenarios)
    ],
    out: OutOption = None,
    workers: JobsOption = None,
    backend: BackendOption = BackendName.LOCAL,
    address: AddressOption = None,
    seed: Annotated[
        int | None, typer.Option(min=1, max=2**32 - 1, help="Use this seed instead of each scenario's own.")
    ] = None,
    repeat: Annotated[
        int, typer.Option(min=1, max=100_000, help="Run each scenario with this many consecutive seeds.")
    ] = 1,
    keyword: Annotated[
        str, typer.Option("-k", help='Select ids and variations by an expression, e.g. "faults and not slip".')
    ] = "",
    tag: Annotated[list[str] | None, typer.Option(help="Select scenarios with this tag; repeatable.")] = None,
    fail_fast: Annotated[
        bool, typer.Option("--fail-fast", "-x", help="Stop after the first run that does not pass.")
    ] = False,
    check_determinism: Annotated[
        bool,
        typer.Option(
            "--check-determinism",
            help="Run everything twice and compare the logs byte for byte. If one of PATHS is the output folder of an "
            "earlier session, run once and compare with that session, as --check-against does.",
        ),
    ] = False,
    check_against: Annotated[
        Path | None,
        typer.Option(help="Compare verdicts and true poses with this output folder of another session or machine."),
    ] = None,
    junit: JunitOption = None,
    junit_family: JunitFamilyOption = JunitFamily.SIMSCEN,
    format_: FormatOption = Format.TEXT,
    wall_limit: WallLimitOption = 300.0,
    resume: ResumeOption = None,
    shard: Annotated[
        str,
        typer.Option(
            help="i/n: run the i-th of n parts of the scenarios; auto: take i and n from the variables of GitLab, "
            "CircleCI, Buildkite, Slurm arrays, or Kubernetes indexed jobs. `simscen merge` merges the results."
        ),
    ] = "1/1",
    shard_by: Annotated[
        list[Path] | None,
        typer.Option(help="Output folder of earlier runs whose times balance the shards; repeatable."),
    ] = None,
    stack: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            autocompletion=completions.stacks,
            help=STACK_HELP
            + "Repeatable: each scenario runs with each stack, and the first is compared with the others.",
        ),
    ] = None,
    last_failed: Annotated[
        bool,
        typer.Option(
            "--last-failed",
            "--lf",
            help="Repeat only runs that failed last time, according to the sessions in simscen-out or in the parent "
            "folder of --out; if none failed, run everything.",
        ),
    ] = False,
    durations: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="List the N slowest runs at the end; 0 = all.")
    ] = None,
    watch: Annotated[bool, typer.Option("--watch", help="Watch for changes and rerun affected scenarios.")] = False,
    open_: OpenOption = False,
    variation: Annotated[
        list[str] | None, typer.Option(help="Select the variation with exactly this name; repeatable.")
    ] = None,
    root: RootOption = None,
    world_path: WorldPathOption = None,
    replay: ReplayOption = OutcomeFilter.FAILED,
    keep_logs: KeepLogsOption = LogRetention.ALL,
    lenient: LenientOption = False,
) -> None:
    """Run scenarios and report what passed.

    All files are validated first; if one is invalid, nothing runs. The output folder receives results.json, junit.xml,
    report.html, and for each run an MCAP log, a picture, the verdicts, and, if it failed, a replay page. If simscen is
    killed, `simscen report` writes the reports from the journal, and --resume continues the session.

    Exit code 0: all runs passed or failed as expected; 1: a criterion failed, or held although it was expected to fail;
    2: an invalid scenario or an unusable output folder (nothing was run); 3: a run could not be completed; 5: nothing
    selected, or everything skipped; 129, 130, and 143: interrupted.
    """
    if keep_logs is LogRetention.FAILED and (check_determinism or check_against is not None):
        raise UsageError("--keep-logs failed excludes --check-determinism and --check-against, which compare logs")
    # All further modules are imported, and the scenarios are loaded, while the fork server starts.
    with early_fork_server(is_needed=backend is BackendName.LOCAL and not watch) as fork_server:
        from simscen.cli.session.backends import workers_and_cluster
        from simscen.cli.session.scenario_session import SessionRequest, execute_session
        from simscen.cli.session.selection import Selection, parse_shard, scenario_times
        from simscen.cli.session.watch import watch_session
        from simscen.report.journal_reader import JOURNAL_FILE
        from simscen.run.sessions.run_session import SessionOptions

        if check_determinism and (earlier := [path for path in paths if (path / JOURNAL_FILE).is_file()]):
            if len(earlier) > 1 or check_against is not None:
                raise UsageError("--check-determinism compares with one earlier session only")
            paths, check_determinism, check_against = [path for path in paths if path not in earlier], False, earlier[0]
            if not paths:
                raise UsageError(f"name the scenarios to compare with the earlier session {check_against}")
        workers, cluster = workers_and_cluster(workers, backend, address)
        request = SessionRequest(
            paths,
            Selection(
                keyword, tag or [], parse_shard(shard, os.environ), variation or [], scenario_times(shard_by or [])
            ),
            SessionOptions(
                workers,
                seed,
                repeat,
                check_determinism,
                fail_fast,
                wall_limit,
                check_against,
                replay=replay,
                keep_logs=keep_logs,
                cluster=cluster,
            ),
            root,
            world_path or [],
            lenient,
            stack or [],
            OutputOptions(out, resume, junit, junit_family, format_, open_),
            durations,
            last_failed,
        )
        sys.exit(watch_session(request) if watch else execute_session(request, unused_server=fork_server))
