"""`simscen run`."""

import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completing
from simscen.cli.diagnostics import as_text, print_text
from simscen.cli.interrupts import signals_interrupt
from simscen.cli.lastfailed import failed_runs
from simscen.cli.reports import JunitFamily, Reports, require_writable, verdict
from simscen.cli.screen import Format, Screen, screen
from simscen.cli.select import Selection, load_all, shard_of
from simscen.cli.stacks import STACK_HELP, commands_of
from simscen.cli.work import Work, begin
from simscen.core.errors import Exit, UsageError
from simscen.core.sessionevents import SessionEvent
from simscen.judge.measure.compare import compare
from simscen.loading.plugins import plugins_of_all
from simscen.report.journal import Journal, require_free
from simscen.report.journaldata import NAME
from simscen.report.rebuild import read_journal
from simscen.run.outfolder import RUNS, make_folder
from simscen.run.plugincode import packages_of
from simscen.run.session import Options, plan, run_session, seeds_of

WARM_PROCESS = ("-m", "simscen.cli.warm_process")


def command(
    paths: Annotated[
        list[Path], typer.Argument(help="Scenario files, or folders to search.", autocompletion=completing.scenarios)
    ],
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
    keyword: Annotated[
        str, typer.Option("-k", help='Only ids and variations that match, e.g. "faults and not slip".')
    ] = "",
    tag: Annotated[list[str] | None, typer.Option(help="Only scenarios with this tag; repeatable.")] = None,
    fail_fast: Annotated[
        bool, typer.Option("--fail-fast", "-x", help="Stop after the first run that does not pass.")
    ] = False,
    check_determinism: Annotated[
        bool,
        typer.Option(
            "--check-determinism",
            help="Run everything twice and compare the logs, byte for byte; with the output folder of an earlier "
            "session behind it, as --check-against.",
        ),
    ] = False,
    check_against: Annotated[
        Path | None,
        typer.Option(help="Compare with this output folder of another session or machine."),
    ] = None,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit XML here as well.")] = None,
    junit_family: Annotated[
        JunitFamily, typer.Option(help="xunit2 leaves out what Jenkins' schema forbids.")
    ] = JunitFamily.SIMSCEN,
    format_: Annotated[Format, typer.Option("--format", help="What to print.")] = Format.TEXT,
    wall_limit: Annotated[float, typer.Option(min=1, help="Seconds of wall time that one run may take.")] = 300.0,
    resume: Annotated[
        Path | None, typer.Option(help="Go on in this output folder: only what has no verdict yet, or has changed.")
    ] = None,
    shard: Annotated[str, typer.Option(help="i/n: only every n-th scenario, from the i-th on.")] = "1/1",
    stack: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            autocompletion=completing.stacks,
            help=STACK_HELP + "Repeatable: each scenario runs with each, and the first is compared with the others.",
        ),
    ] = None,
    last_failed: Annotated[
        bool,
        typer.Option(
            "--last-failed",
            "--lf",
            help="Only what failed when it was run last, by the sessions in simscen-out, or beside --out; everything, "
            "where nothing did.",
        ),
    ] = False,
    durations: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="List the N slowest runs in the end; 0 = all.")
    ] = None,
    variation: Annotated[
        list[str] | None, typer.Option(help="Only the variation of exactly this name; repeatable.")
    ] = None,
    root: Annotated[Path | None, typer.Option(help="Files inside scenarios stay in this folder.")] = None,
    world_path: Annotated[list[Path] | None, typer.Option(help="Folder with worlds and models; repeatable.")] = None,
    lenient: Annotated[
        bool, typer.Option("--lenient", help="Leave out what of an SDF world cannot be used, with a warning.")
    ] = False,
) -> None:
    """Run scenarios and report what passed.

    Everything is validated first; with one bad file nothing is run. Each run leaves its MCAP log, a picture and its
    verdicts in the output folder, beside results.json and junit.xml. Should simscen itself be killed, `simscen report`
    makes these from the journal, and --resume goes on where it stopped.

    Exit code 0: all passed, or failed as expected; 1: a criterion failed, or held although it was expected to fail; 2:
    an invalid scenario or an unusable output folder (nothing was run); 3: a run could not be completed; 5: nothing
    selected, or everything skipped; 129, 130 and 143: interrupted.
    """
    if check_determinism and (earlier := [path for path in paths if (path / NAME).is_file()]):
        paths, check_determinism, check_against = [p for p in paths if p not in earlier], False, earlier[0]
    wanted = Selection(keyword, tag or [], shard_of(shard), variation or [])
    scenarios, warnings = load_all(paths, root, world_path or [], lenient, wanted, stack or [])
    if warnings:
        print_text(as_text(warnings), sys.stderr)
    options = Options(workers or _cores(), seed, repeat, check_determinism, fail_fast, wall_limit, check_against)
    if check_against is not None and not (check_against / RUNS).is_dir():
        raise UsageError(f"--check-against {check_against}: there are no runs in it")
    for scenario in scenarios:
        seeds_of(scenario, options)
    if last_failed:
        if resume is not None:
            raise UsageError("--last-failed and --resume exclude each other")
        only, told = failed_runs(scenarios, options, out)
        options = replace(options, only=only)
        print_text(f"simscen: {told}", sys.stderr)
    require_writable(junit, out or resume, {file for each in scenarios for file in (*each.files.values(), *each.read)})
    folder, journal = _output_folder(out, resume)
    used = {"plugins": packages_of(plugins_of_all(scenarios)), "stacks": commands_of(scenarios)}
    reports = Reports(folder, junit, junit_family.value, used=used)
    reports.begin()
    work = begin(journal, plan(scenarios, options, folder), options.workers)
    with screen(format_, durations) as shown:
        code = _run(work, options, reports, shown)
    sys.exit(shown.exit(code))


def _run(work: Work, options: Options, reports: Reports, shown: Screen) -> Exit:
    """Do what is left to do, tell the journal, the screen and the reports, and say how it went."""
    begun = time.monotonic()

    def listen(event: SessionEvent) -> None:
        work.journal(event)
        shown(event)

    shown(work.started(reports.folder))
    for answer in work.kept:
        shown(answer)
    with signals_interrupt():
        answers, stopped = run_session(work.jobs, options, WARM_PROCESS, listen)
    answers = [*work.kept, *answers]
    work.journal.complete(answers)
    comparison = compare((answer.result for answer in answers), work.stacks)
    written = reports.write(answers, comparison)
    wall = time.monotonic() - begun
    listen(reports.closing(answers, wall, stopped is not None, comparison))
    written = reports.end(wall) and written and _kept(work.journal)
    code = verdict(answers)
    if code is Exit.NOTHING_SELECTED:
        print_text("simscen: nothing was run: every scenario that was chosen says to skip it", sys.stderr)
    return stopped or (code if written else Exit.INCOMPLETE)


def _kept(journal: Journal) -> bool:
    """Whether the journal is whole; told if it is not."""
    if journal.error is not None:
        told = f"simscen: lines are missing from the journal in {journal.folder}: {journal.error.strerror}"
        print_text(told, sys.stderr)
    return journal.error is None


def _output_folder(out: Path | None, resume: Path | None) -> tuple[Path, Journal]:
    """The folder and its journal, locked. Raises UsageError before anything in it is touched."""
    if resume is not None and out is not None:
        raise UsageError("--out and --resume exclude each other")
    if resume is not None:
        read_journal(resume)
    elif out is not None:
        require_free(out)
    folder = resume or make_folder(out)
    try:
        return folder, Journal(folder, goes_on=resume is not None)
    except OSError as error:
        raise UsageError(f"cannot use the output folder {folder}: {error.strerror}") from error


def _cores() -> int:
    return len(os.sched_getaffinity(0))
