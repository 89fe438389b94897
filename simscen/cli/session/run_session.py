"""One session of `simscen run`, from its options to its exit code."""

import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

from simscen.cli.diagnostics import as_text, print_text
from simscen.cli.interrupts import signals_interrupt
from simscen.cli.session.output_files import JunitFamily, LivePage, Reports, require_writable, verdict
from simscen.cli.session.pending_runs import PendingRuns, begin, failed_runs
from simscen.cli.session.selection import Selection, load_all
from simscen.cli.session.stacks import commands_of
from simscen.cli.session.terminal import Format, Screen, screen
from simscen.core.errors import Exit, UsageError
from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import Listener, SessionEvent
from simscen.judge.metrics.stack_comparison import compare_stacks
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of_all
from simscen.report.journal import Journal, require_free
from simscen.report.journal_reader import read_journal
from simscen.run.reproducibility.environment import plugin_packages
from simscen.run.sessions.output_folder import RUNS_FOLDER, create_output_folder
from simscen.run.sessions.run_session import SessionOptions, plan_jobs, run_session, scenario_seeds

WARM_PROCESS = ("-m", "simscen.cli.session.warm_process")


class Observer(Protocol):
    """Whoever wants to know what a session is about and how it goes."""

    def loaded(self, scenarios: Sequence[LoadedScenario]) -> None:
        """These are valid and chosen."""
        ...

    def __call__(self, event: SessionEvent) -> None:
        """Take one event."""
        ...


@dataclass(frozen=True)
class SessionRequest:
    """What the command line asks for; each field means what the option of its name does."""

    paths: Sequence[Path]
    wanted: Selection = field(default_factory=Selection)
    options: SessionOptions = field(default_factory=SessionOptions)
    root: Path | None = None
    world_path: Sequence[Path] = ()
    lenient: bool = False
    stacks: Sequence[str] = ()
    out: Path | None = None
    resume: Path | None = None
    junit: Path | None = None
    junit_family: JunitFamily = JunitFamily.SIMSCEN
    format_: Format = Format.TEXT
    durations: int | None = None
    last_failed: bool = False
    open_: bool = False


def execute_session(asked: SessionRequest, observer: Observer | None = None) -> Exit:
    """Do it, and leave its reports. Raises InvalidInput, UsageError and NothingSelected before anything runs."""
    options = asked.options
    scenarios, warnings = load_all(asked.paths, asked.root, asked.world_path, asked.lenient, asked.wanted, asked.stacks)
    if observer is not None:
        observer.loaded(scenarios)
    if warnings:
        print_text(as_text(warnings), sys.stderr)
    if options.against is not None and not (options.against / RUNS_FOLDER).is_dir():
        raise UsageError(f"--check-against {options.against}: there are no runs in it")
    for scenario in scenarios:
        scenario_seeds(scenario, options)
    if asked.last_failed:
        options = replace(options, only=_last_failed(scenarios, asked))
    inputs = {file for each in scenarios for file in (*each.files.values(), *each.read)}
    require_writable(asked.junit, asked.out or asked.resume, inputs)
    folder, journal = output_folder(asked.out, asked.resume)
    used = {"plugins": plugin_packages(plugins_of_all(scenarios)), "stacks": commands_of(scenarios)}
    reports = Reports(folder, asked.junit, asked.junit_family.value, used=used)
    reports.begin()
    work = begin(journal, plan_jobs(scenarios, options, folder), options.workers)
    with screen(asked.format_, asked.durations) as shown:
        listeners: list[Listener] = [*([observer] if observer else []), *([LivePage(reports)] if asked.open_ else [])]
        code = _run(work, options, reports, shown, listeners)
    return shown.exit(code)


def _last_failed(scenarios: Sequence[LoadedScenario], asked: SessionRequest) -> frozenset[RunKey] | None:
    if asked.resume is not None:
        raise UsageError("--last-failed and --resume exclude each other")
    only, told = failed_runs(scenarios, asked.options, asked.out)
    print_text(f"simscen: {told}", sys.stderr)
    return only


def _run(
    work: PendingRuns, options: SessionOptions, reports: Reports, shown: Screen, listeners: Sequence[Listener]
) -> Exit:
    """Do what is left to do, tell the journal, the screen, all who listen and the reports, and say how it went."""
    begun = time.monotonic()

    def show(event: SessionEvent) -> None:
        shown(event)
        for each in listeners:
            each(event)

    def listen(event: SessionEvent) -> None:
        work.journal(event)
        show(event)

    show(work.started(reports.folder))
    for answer in work.kept:
        show(answer)
    with signals_interrupt():
        answers, stopped = run_session(work.jobs, options, WARM_PROCESS, listen)
    answers = [*work.kept, *answers]
    work.journal.complete(answers)
    comparison = compare_stacks((answer.result for answer in answers), work.stacks)
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


def output_folder(out: Path | None, resume: Path | None) -> tuple[Path, Journal]:
    """The folder and its journal, locked. Raises UsageError before anything in it is touched."""
    if resume is not None and out is not None:
        raise UsageError("--out and --resume exclude each other")
    if resume is not None:
        read_journal(resume)
    elif out is not None:
        require_free(out)
    folder = resume or create_output_folder(out)
    try:
        return folder, Journal(folder, goes_on=resume is not None)
    except OSError as error:
        raise UsageError(f"cannot use the output folder {folder}: {error.strerror}") from error


def cores() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0))
