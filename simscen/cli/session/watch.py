"""Watch mode of `simscen run`, which reruns scenarios when one of their files changes.

Each session runs in a child process, which reports files and outcomes to the watching process through a pipe.
"""

import json
import os
import select
import signal
import sys
import termios
import tty
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

from simscen.cli.diagnostics import print_text
from simscen.cli.session.scenario_session import SessionRequest, execute_session
from simscen.core.errors import Exit, InvalidInput, Problem, SimscenError, UsageError
from simscen.core.records.session_events import RunFinished, SessionEvent
from simscen.loading.files.discovery import default_root, discover
from simscen.loading.files.paths import absolute_path
from simscen.loading.loaded import LoadedScenario
from simscen.report.display_text import number_with_noun
from simscen.report.journal_reader import JOURNAL_FILE
from simscen.run.process.isolation import die_with_parent
from simscen.run.reproducibility import scenario_files

FileStamps = dict[Path, tuple[int, int, int] | None]
"""Modification time in ns, size in bytes, and inode of each file; None if the file does not exist."""


def file_stamps(files: Iterable[Path]) -> FileStamps:
    """Return the stamps of the files."""
    stamps: FileStamps = {}
    for file in files:
        try:
            status = file.stat()
            stamps[file] = status.st_mtime_ns, status.st_size, status.st_ino
        except OSError:
            stamps[file] = None
    return stamps


def searched_folders(path: Path) -> Iterator[Path]:
    """Yield a folder and its subfolders, except hidden folders and output folders; nothing for a file."""
    for folder, subfolders, names in os.walk(path.absolute()):
        if JOURNAL_FILE in names:
            subfolders.clear()
            continue
        subfolders[:] = [name for name in subfolders if not name.startswith(".")]
        yield Path(folder)


class WatchReporter:
    """Listener in the child process that writes the files and the outcomes of scenarios to a pipe, as JSON lines."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._files: dict[str, str] = {}

    def write_files(self, scenarios: Sequence[LoadedScenario]) -> None:
        """Write the files of each scenario."""
        files_of: dict[str, set[Path]] = {}
        for scenario in scenarios:
            self._files[scenario.id] = str(scenario.file)
            files_of.setdefault(str(scenario.file), set()).update(scenario_files(scenario))
        for file, others in files_of.items():
            self._write({"scenario": file, "files": sorted(map(str, others))})

    def write_invalid_files(self, problems: Iterable[Problem]) -> None:
        """Write the files that have these problems. The problems prevented the session."""
        self._write({"invalid": sorted({str(Path(problem.path).absolute()) for problem in problems})})

    def __call__(self, event: SessionEvent) -> None:
        """Write the outcome of a finished run. Ignore other events."""
        if isinstance(event, RunFinished):
            self._write({"scenario": self._files[event.key.scenario], "good": event.outcome.is_good})

    def _write(self, message: dict[str, Any]) -> None:
        self._out.write(json.dumps(message) + "\n")
        self._out.flush()


class WatchState:
    """State of the watch mode: scenarios, the files of each scenario, and the scenarios that did not pass."""

    def __init__(self, find_scenarios: Callable[[], Sequence[Path]], paths: Iterable[Path]) -> None:
        """Take the paths to watch, and a function that returns the scenarios below these paths."""
        self._find_scenarios, self._paths = find_scenarios, tuple(paths)
        self._folders: set[Path] = set()
        self._files: dict[Path, set[Path]] = {file: {file} for file in self._discover()}
        self._not_passed: set[Path] = set()
        self._invalid: set[Path] = set()
        self._requested: Sequence[Path] = ()
        self._unfinished: Sequence[Path] = ()

    @property
    def scenarios(self) -> list[Path]:
        """All watched scenarios."""
        return sorted(self._files)

    @property
    def failed(self) -> list[Path]:
        """Scenarios with a run that failed or had an error in their last session."""
        return sorted(self._not_passed & self._files.keys())

    @property
    def files(self) -> list[Path]:
        """Files and folders to watch. A folder changes when a scenario or subfolder is added."""
        return sorted({*self._folders, *self._invalid, *(file for files in self._files.values() for file in files)})

    def begin(self, paths: Sequence[Path]) -> None:
        """Record the start of a session with these scenarios or folders."""
        self._requested, self._invalid = paths, set()
        self._not_passed -= {file for path in paths for file in self._below(path)}

    def update(self, line: str) -> None:
        """Process a line from the WatchReporter of the session."""
        message = json.loads(line)
        if "invalid" in message:
            self._invalid = set(map(Path, message["invalid"]))
            return
        scenario = Path(message["scenario"])
        if "files" in message:
            self._files[scenario] = {Path(file) for file in message["files"]}
            self._folders |= {scenario.parent}
        elif not message["good"]:
            self._not_passed.add(scenario)

    def end(self, code: int) -> None:
        """Record the exit code of the session. A session with an invalid file is repeated after the next change."""
        self._unfinished = self._requested if code == Exit.USAGE else ()

    def scenarios_to_run(self, changed: set[Path]) -> Sequence[Path]:
        """Return the scenarios to run after these files changed: affected scenarios and new scenarios.

        If an invalid file prevented the last session, also return all scenarios of that session.
        """
        unfinished = {file for path in self._unfinished for file in self._below(path)}
        known = set(self._files)
        existing = set(self._discover()) if changed & self._folders else known
        self._files = {file: self._files.get(file, {file}) for file in sorted(existing)}
        new = existing - known
        affected = {file for file, files in self._files.items() if files & changed}
        return sorted((affected | new | unfinished) & existing)

    def _below(self, path: Path) -> list[Path]:
        """Return the watched scenarios in a folder, or the scenario at `path` itself."""
        return [file for file in self._files if file.is_relative_to(absolute_path(path))]

    def _discover(self) -> Sequence[Path]:
        """Return the existing scenarios (none if the search fails), and watch the folders in which they can be."""
        self._folders |= {folder for path in self._paths for folder in searched_folders(path)}
        try:
            return self._find_scenarios()
        except SimscenError:
            return ()


POLL_INTERVAL_S = 0.25
"""Time between two checks of the files."""
INTERRUPTED_CODES = (Exit.HUNG_UP, Exit.INTERRUPTED, Exit.TERMINATED)
"""Exit codes of a session that end the watch mode."""


def watch_session(request: SessionRequest) -> int:
    """Run a session, and then sessions with the affected scenarios after each change, until q or Ctrl-C is pressed.

    Return the last exit code. Raises UsageError for options that exclude --watch.
    """
    for name, value in (("--out", request.output.out), ("--resume", request.output.resume)):
        if value is not None:
            raise UsageError(f"--watch and {name} exclude each other: each session has its own folder")
    if request.output.open_:
        raise UsageError("--watch and --open exclude each other: each session has its own page")
    if request.selection.shard != (1, 1):
        raise UsageError("--watch and --shard exclude each other")
    root_folder = request.root or default_root(request.paths)
    state = WatchState(lambda: discover(request.paths, root_folder), request.paths)
    code, stamps = _run_in_child(replace(request, root=root_folder), state)
    while code not in INTERRUPTED_CODES:
        keys = f"a = run all, f = run those that did not pass ({len(state.failed)}), q = quit"
        print_text(f"watching {number_with_noun(len(state.scenarios), 'scenario')}: {keys}")
        sys.stdout.flush()
        files = _wait_for_changes(state, stamps)
        if files is None:
            break
        next_request = replace(request, paths=files, root=root_folder, last_failed=False)
        code, stamps = _run_in_child(next_request, state)
    return code


def _run_in_child(request: SessionRequest, state: WatchState) -> tuple[int, FileStamps]:
    """Run a session in a child process. Return its exit code, and the stamps of the files before the session."""
    stamps_before = file_stamps(state.files)
    reading, writing = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    watching_process = os.getpid()
    pid = os.fork()
    if pid == 0:
        die_with_parent(watching_process)
        os.close(reading)
        with os.fdopen(writing, "w", encoding="utf-8") as pipe:
            reporter = WatchReporter(pipe)
            try:
                sys.exit(execute_session(request, reporter.write_files, [reporter]))
            except InvalidInput as error:
                reporter.write_invalid_files(error.problems)
                raise
    os.close(writing)
    # A terminal sends SIGINT and SIGHUP also to the child process, which handles them.
    handlers = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGHUP)}
    handlers[signal.SIGTERM] = signal.signal(signal.SIGTERM, lambda number, _: os.kill(pid, number))
    try:
        with os.fdopen(reading, encoding="utf-8") as lines:
            state.begin(request.paths)
            for line in lines:
                state.update(line)
            code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
            code = 128 - code if code < 0 else code  # a signal ended the process before it handled signals
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    state.end(code)
    now = file_stamps(state.files)
    return code, {**now, **{file: stamp for file, stamp in stamps_before.items() if file in now}}


def _wait_for_changes(state: WatchState, previous: FileStamps) -> Sequence[Path] | None:
    """Wait for a key or a change of a file, and return the scenarios to run; None to quit.

    `previous` are the stamps of the files before the last session.
    """
    with _keys() as keys:
        while True:
            key = keys()
            if key == "q":
                return None
            if key == "a" and state.scenarios:
                return state.scenarios
            if key == "f" and state.failed:
                return state.failed
            now = file_stamps(state.files)
            if now == previous:
                continue
            settled: FileStamps = {}
            while settled != now:  # wait until no more files are written
                settled = now
                select.select([], [], [], POLL_INTERVAL_S)
                now = file_stamps(state.files)
            changed = {file for file in {*now, *previous} if now.get(file) != previous.get(file)}
            previous = now
            if affected := state.scenarios_to_run(changed):
                return affected


@contextmanager
def _keys() -> Iterator[Callable[[], str]]:
    """Provide a reader of single keys without echo within the context, and restore the terminal afterwards.

    A call of the reader waits up to POLL_INTERVAL_S, and returns the key, or "" without a key.
    """
    inputs = [0]

    def read_key() -> str:
        readable, _, _ = select.select(inputs, [], [], POLL_INTERVAL_S)
        key = os.read(0, 1).decode("latin-1") if readable else ""
        if readable and not key:  # the end of stdin, which would always be readable
            inputs.clear()
        return key

    previous = termios.tcgetattr(0) if os.isatty(0) else None
    if previous is not None:
        tty.setcbreak(0, termios.TCSANOW)
    try:
        yield read_key
    finally:
        if previous is not None:
            termios.tcsetattr(0, termios.TCSANOW, previous)
