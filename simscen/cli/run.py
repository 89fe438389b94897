"""`simscen run`."""

import os
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from simscen import __version__
from simscen.cli.reports import Format, Reports, printer, step_summary
from simscen.cli.select import load_all
from simscen.core.errors import Exit, UsageError
from simscen.core.session import Listener, Outcome, RunFinished, SessionFinished, SessionStarted
from simscen.run.jobs import Job
from simscen.run.outfolder import make_folder, probe_writable
from simscen.run.session import Options, plan, run_session
from simscen.run.supervisor import Interrupted


class Family(str, Enum):
    """Dialects of JUnit XML."""

    SIMSCEN = "simscen"
    XUNIT2 = "xunit2"


ZYGOTE = ("-m", "simscen.cli.zygote")


def command(
    paths: Annotated[list[Path], typer.Argument(help="Scenario files, or folders to search.")],
    out: Annotated[
        Path | None, typer.Option(help="Output folder, new or empty; default: simscen-out/<run-id>.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option("-j", "--jobs", min=1, max=256, help="Runs at a time; default: one for each core.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=1, max=2**32 - 1, help="Use this seed instead of each scenario's own.")
    ] = None,
    repeat: Annotated[
        int, typer.Option(min=1, max=100_000, help="Run each scenario with this many seeds in a row.")
    ] = 1,
    keyword: Annotated[str, typer.Option("-k", help='Only ids that match, e.g. "faults and not slip".')] = "",
    tag: Annotated[list[str] | None, typer.Option(help="Only scenarios with this tag; repeatable.")] = None,
    fail_fast: Annotated[
        bool, typer.Option("--fail-fast", "-x", help="Stop after the first run that does not pass.")
    ] = False,
    check_determinism: Annotated[
        bool, typer.Option("--check-determinism", help="Run everything twice and compare the logs, byte for byte.")
    ] = False,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit XML here as well.")] = None,
    junit_family: Annotated[
        Family, typer.Option(help="xunit2 leaves out what Jenkins' schema forbids.")
    ] = Family.SIMSCEN,
    format_: Annotated[Format, typer.Option("--format", help="What to print.")] = Format.TEXT,
    wall_limit: Annotated[float, typer.Option(min=1, help="Seconds of wall time that one run may take.")] = 300.0,
    root: Annotated[Path | None, typer.Option(help="Files inside scenarios stay in this folder.")] = None,
    world_path: Annotated[list[Path] | None, typer.Option(help="Folder with worlds and models; repeatable.")] = None,
) -> None:
    """Run scenarios and report what passed.

    Everything is validated first; with one bad file nothing is run. Each run leaves its MCAP log, a picture and its
    verdicts in the output folder, beside results.json and junit.xml.

    Exit code 0: all passed; 1: a criterion failed; 2: an invalid scenario or an unusable output folder (nothing was
    run); 3: a run could not be completed; 5: nothing selected; 130 and 143: interrupted.
    """
    scenarios = load_all(paths, root, world_path or [], keyword, tag or [])
    options = Options(workers or _cores(), seed, repeat, check_determinism, fail_fast, wall_limit)
    _require_writable(junit)
    folder = make_folder(out)
    reports = Reports(folder, junit, junit_family.value)
    with step_summary() as summary, printer(format_, summary) as listen:
        code = _run(plan(scenarios, options, folder), options, reports, listen)
    sys.exit(code)


def _run(jobs: Sequence[Job], options: Options, reports: Reports, listen: Listener) -> Exit:
    """Run all jobs, tell the reports, and say how it went."""
    begun = time.monotonic()
    scenarios = len({job.scenario.id for job in jobs})
    listen(SessionStarted(__version__, len(jobs), scenarios, options.workers, str(reports.folder)))
    with _signals_interrupt():
        answers, stopped = run_session(jobs, options, ZYGOTE, listen)
    written = reports.write(answers, time.monotonic() - begun)
    count = {outcome: sum(answer.outcome is outcome for answer in answers) for outcome in Outcome}
    listen(
        SessionFinished(
            count[Outcome.PASSED],
            count[Outcome.FAILED],
            count[Outcome.ERROR],
            simulated=sum(answer.simulated for answer in answers),
            wall=time.monotonic() - begun,
            interrupted=stopped is not None,
            junit=str(reports.junit),
            folder=str(reports.folder),
        )
    )
    return stopped or verdict(answers) if written else Exit.INCOMPLETE


def verdict(answers: Sequence[RunFinished]) -> Exit:
    """The exit code of a session that was not interrupted."""
    outcomes = {answer.outcome for answer in answers}
    if Outcome.ERROR in outcomes:
        only_skipped = all(a.error and a.error.kind == "not-run" for a in answers if a.outcome is Outcome.ERROR)
        return Exit.FAILED if only_skipped and Outcome.FAILED in outcomes else Exit.INCOMPLETE
    return Exit.FAILED if Outcome.FAILED in outcomes else Exit.PASSED


@contextmanager
def _signals_interrupt() -> Iterator[None]:
    """Turn the first SIGINT or SIGTERM into an orderly end; more of them change nothing."""

    def interrupt(number: int, _: FrameType | None) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        raise Interrupted(number)

    before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGINT) is interrupt:
            for number, handler in before.items():
                signal.signal(number, handler)


def _require_writable(junit: Path | None) -> None:
    """An unwritable report is known before anything runs."""
    if junit is None:
        return
    try:
        junit.parent.mkdir(parents=True, exist_ok=True)
        probe_writable(junit)
    except OSError as error:
        raise UsageError(f"cannot write {junit}: {error.strerror}") from error


def _cores() -> int:
    return len(os.sched_getaffinity(0))
