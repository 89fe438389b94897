"""Implementation of `simscen run`: loads scenarios, simulates their runs, and writes the reports."""

import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from simscen.cli.diagnostics import as_text, print_text
from simscen.cli.session.backends import backend_of, interrupt_on_signals
from simscen.cli.session.exit_codes import exit_code
from simscen.cli.session.live_page import LivePage
from simscen.cli.session.output_files import Reports, require_writable_junit
from simscen.cli.session.pending_runs import PendingRuns, failed_runs, plan_session
from simscen.cli.session.selection import Selection, load_selection
from simscen.cli.session.stacks import external_commands
from simscen.cli.session.terminal import open_screen
from simscen.cli.shared_options import OutputOptions
from simscen.core.errors import Exit, UsageError
from simscen.core.records.comparison import Comparison
from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import Listener, RunFinished, broadcast
from simscen.core.records.study import Study
from simscen.judge.metrics.comparison import compare_stacks
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of_all
from simscen.report.journal import Journal, require_unlocked
from simscen.report.journal_reader import JOURNAL_FILE, read_journal
from simscen.run.process.fork_server_process import ForkServerProcess
from simscen.run.reproducibility import plugin_packages
from simscen.run.sessions.output_folder import RUNS_FOLDER, create_output_folder
from simscen.run.sessions.run_session import SessionOptions, plan_jobs, run_session, scenario_seeds


@dataclass(frozen=True)
class SessionRequest:
    """Arguments of `simscen run` by name. `selection`, `options`, and `output` each contain several arguments."""

    paths: Sequence[Path]
    selection: Selection
    options: SessionOptions
    root: Path | None
    world_path: Sequence[Path]
    lenient: bool
    stacks: Sequence[str]
    output: OutputOptions
    durations: int | None
    last_failed: bool


def execute_session(
    request: SessionRequest,
    on_loaded: Callable[[Sequence[LoadedScenario]], None] = lambda _: None,
    listeners: Sequence[Listener] = (),
    unused_server: ForkServerProcess | None = None,
) -> Exit:
    """Run a session, write its reports, and return the exit code.

    `on_loaded` is called with the selected scenarios before the first run. `listeners` receive all events.
    `unused_server` is a fork server that was started before, and has not been used yet. Raises InvalidInput,
    UsageError, and NothingSelected before the first run.
    """
    options, output = request.options, request.output
    scenarios, warnings = load_selection(
        request.paths, request.root, request.world_path, request.lenient, request.selection, request.stacks
    )
    on_loaded(scenarios)
    if warnings:
        print_text(as_text(warnings), sys.stderr)
    if options.check_against is not None and not (options.check_against / RUNS_FOLDER).is_dir():
        reason = "the folder contains no runs" if options.check_against.is_dir() else "no such folder"
        raise UsageError(f"--check-against {options.check_against}: {reason}")
    for scenario in scenarios:
        scenario_seeds(scenario, options)
    if request.last_failed:
        if output.resume is not None:
            raise UsageError("--last-failed and --resume exclude each other")
        selected_runs, message = failed_runs(scenarios, options, output.out)
        print_text(f"simscen: {message}", sys.stderr)
        options = replace(options, selected_runs=selected_runs)
    inputs = {file for each in scenarios for file in (*each.files.values(), *each.read_files)}
    reports, journal = start_session(output, inputs, plugins_and_stacks(scenarios))
    jobs = plan_jobs(scenarios, options, reports.folder)
    pending = plan_session(journal, jobs, options.workers, request.selection.shard)
    with open_screen(output.format_, request.durations) as screen:
        live = [LivePage(reports)] if output.open_ else []
        code = _run(pending, options, reports, broadcast(screen, *listeners, *live), unused_server)
    return screen.exit_code(code)


def _run(
    pending: PendingRuns,
    options: SessionOptions,
    reports: Reports,
    listener: Listener,
    unused_server: ForkServerProcess | None,
) -> Exit:
    """Execute the pending runs, write the reports, and return the exit code.

    `listener` receives all events, including the events of reused results.
    """
    start, journal_and_listener = time.monotonic(), broadcast(pending.journal, listener)
    listener(pending.start_event(reports.folder))
    for finished in pending.reused_results:
        listener(finished)
    with interrupt_on_signals(), backend_of(options, unused_server) as backend:
        done, stopped = run_session(pending.jobs, options, backend, journal_and_listener)
    finished_runs = RunStore(pending.reused_results)
    finished_runs.extend(done)
    pending.journal.complete(finished_runs)
    comparison = compare_stacks((finished.result for finished in finished_runs), pending.stacks)
    written = finish_session(
        reports, pending.journal, journal_and_listener, finished_runs, start, stopped is not None, comparison
    )
    code = exit_code(finished_runs)
    if code is Exit.NOTHING_SELECTED:
        print_text("simscen: nothing was run: all selected scenarios are skipped", sys.stderr)
    return stopped or (code if written else Exit.INCOMPLETE)


def start_session(
    output: OutputOptions,
    inputs: Iterable[Path],
    extra_entries: Mapping[str, object] | None = None,
    is_resumable: bool = True,
) -> tuple[Reports, Journal]:
    """Create the output folder with its journal and run.json. `extra_entries` are added to run.json.

    The file of --junit must not be one of the `inputs`. `is_resumable` is true if the command has the option --resume.
    Raises InvalidInput and UsageError.
    """
    require_writable_junit(output.junit, output.out or output.resume, inputs)
    folder, journal = open_output_folder(output.out, output.resume)
    reports = Reports(
        folder, output.junit, output.junit_family.value, extra_entries=extra_entries, is_resumable=is_resumable
    )
    reports.begin()
    return reports, journal


def finish_session(
    reports: Reports,
    journal: Journal,
    listener: Listener,
    finished_runs: Sequence[RunFinished],
    start: float,
    is_interrupted: bool,
    comparison: Comparison | None = None,
    study: Study | None = None,
) -> bool:
    """Write the reports of a session, send its last event to `listener`, and close the journal.

    Return whether all files were written. `start` is the value of time.monotonic() at the start of the session. Without
    runs, only run.json is written.
    """
    written = not finished_runs or reports.write(finished_runs, comparison, study)
    wall = time.monotonic() - start
    listener(reports.finished_event(finished_runs, wall, is_interrupted, comparison, study))
    written = reports.write_duration(wall) and written
    journal.close()
    if journal.error is not None:
        reason = journal.error.strerror
        print_text(f"simscen: the journal in {journal.folder} is incomplete: {reason}", sys.stderr)
    return written and journal.error is None


def plugins_and_stacks(scenarios: Sequence[LoadedScenario]) -> dict[str, object]:
    """Return the entries of run.json about the plug-ins and external stacks that the scenarios use."""
    return {"plugins": plugin_packages(plugins_of_all(scenarios)), "stacks": external_commands(scenarios)}


def open_output_folder(out: Path | None, resume: Path | None) -> tuple[Path, Journal]:
    """Return the output folder and its journal. The journal locks the folder against other processes.

    The folder is the one of --out or --resume, or a new folder in simscen-out. Raises InvalidInput and UsageError
    before the folder is changed.
    """
    if resume is not None and out is not None:
        raise UsageError("--out and --resume exclude each other")
    if resume is not None and not _has_empty_journal(resume):
        read_journal(resume)
    elif out is not None:
        require_unlocked(out)
    folder = resume or create_output_folder(out)
    try:
        return folder, Journal(folder, resume=resume is not None)
    except OSError as error:
        raise UsageError(f"cannot use the output folder {folder}: {error.strerror}") from error


def _has_empty_journal(folder: Path) -> bool:
    """Return whether the session in the folder was killed before it planned its runs."""
    journal = folder / JOURNAL_FILE
    return journal.is_file() and not journal.stat().st_size
