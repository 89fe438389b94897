"""What `--watch` knows: which files each scenario is made of, and how it came out last."""

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
from simscen.cli.session.run_session import SessionRequest, execute_session
from simscen.core.errors import Exit, InvalidInput, Problem, SimscenError, UsageError
from simscen.core.records.session_events import RunFinished, SessionEvent
from simscen.loading.files.discovery import default_root, discover
from simscen.loading.loaded import LoadedScenario
from simscen.run.reproducibility.digest import scenario_files

FileStamps = dict[Path, tuple[int, int, int] | None]


def file_stamps(files: Iterable[Path]) -> FileStamps:
    """What changes when a file is saved, of each; None = it is not there."""
    return {file: _stamp(file) for file in files}


def _stamp(file: Path) -> tuple[int, int, int] | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


class WatchReporter:
    """Listens to a session and writes down for the one that watches what it is made of and how it comes out."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._files: dict[str, str] = {}

    def loaded(self, scenarios: Sequence[LoadedScenario]) -> None:
        """Write down the files of each."""
        made_of: dict[str, set[Path]] = {}
        for scenario in scenarios:
            self._files[scenario.id] = str(scenario.file)
            made_of.setdefault(str(scenario.file), set()).update(scenario_files(scenario))
        for file, others in made_of.items():
            self._write({"scenario": file, "files": sorted(map(str, others))})

    def mistakes(self, problems: Iterable[Problem]) -> None:
        """Write down which files keep the session from running."""
        self._write({"mistaken": sorted({str(Path(problem.path).absolute()) for problem in problems})})

    def __call__(self, event: SessionEvent) -> None:
        """Write down how a run came out."""
        if isinstance(event, RunFinished):
            self._write({"scenario": self._files[event.key.scenario], "good": event.outcome.good})

    def _write(self, message: dict[str, Any]) -> None:
        self._out.write(json.dumps(message) + "\n")
        self._out.flush()


class WatchState:
    """The scenarios that `found` finds below `paths`, the files of each, and those that did not pass.

    A session that a mistake in some file kept from running is not done: any change of a file lets it try again.
    """

    def __init__(self, found: Callable[[], Sequence[Path]], paths: Iterable[Path]) -> None:
        self._found = found
        self._folders = {path.absolute() for path in paths if path.is_dir()}
        self._files: dict[Path, set[Path]] = {file: {file} for file in self._discovered()}
        self._bad: set[Path] = set()
        self._mistaken: set[Path] = set()
        self._asked: Sequence[Path] = ()
        self._unfinished: Sequence[Path] = ()

    @property
    def scenarios(self) -> list[Path]:
        """All that there are."""
        return sorted(self._files)

    @property
    def failed(self) -> list[Path]:
        """Those with a run that did not pass when it was made last."""
        return sorted(self._bad & self._files.keys())

    @property
    def files(self) -> list[Path]:
        """What to look at: files, and the folders in which new scenarios may appear."""
        return sorted({*self._folders, *self._mistaken, *(file for files in self._files.values() for file in files)})

    def begin(self, paths: Sequence[Path]) -> None:
        """A session of these begins."""
        self._asked, self._mistaken = paths, set()
        self._bad -= {file for path in paths for file in self._below(path)}

    def learn(self, line: str) -> None:
        """Take a line of a session's report."""
        message = json.loads(line)
        if "mistaken" in message:
            self._mistaken = set(map(Path, message["mistaken"]))
            return
        scenario = Path(message["scenario"])
        if "files" in message:
            self._files[scenario] = {Path(file) for file in message["files"]}
            self._folders |= {scenario.parent}
        elif not message["good"]:
            self._bad.add(scenario)

    def end(self, code: int) -> None:
        """The session has ended so; after a mistake in a file it is still to be done."""
        self._unfinished = self._asked if code == Exit.USAGE else ()

    def touched(self, changed: set[Path]) -> Sequence[Path]:
        """The scenarios to run now that these files have changed."""
        unfinished = {file for path in self._unfinished for file in self._below(path)}
        known = set(self._files)
        there = set(self._discovered()) if changed & self._folders else known
        self._files = {file: self._files.get(file, {file}) for file in sorted(there)}
        new = there - known
        touched = {file for file, files in self._files.items() if files & changed}
        return sorted((touched | new | unfinished) & there)

    def _below(self, path: Path) -> list[Path]:
        return [file for file in self._files if file.is_relative_to(path.absolute())]

    def _discovered(self) -> Sequence[Path]:
        """None where they cannot be told apart: the session will say why."""
        try:
            return self._found()
        except SimscenError:
            return ()


POLL_INTERVAL_S = 0.25
"""Seconds between two looks at the files; two looks that are equal end a burst of saving."""
STOPPED = (Exit.HUNG_UP, Exit.INTERRUPTED, Exit.TERMINATED)


def watch_session(asked: SessionRequest) -> int:
    """Run it, wait, run again what was touched, until q or Ctrl-C; the exit code is that of the last session.

    Each session has a process of its own, a copy of this one: what it loads, plug-ins too, is loaded anew each time.
    """
    for name, value in (("--out", asked.out), ("--resume", asked.resume)):
        if value is not None:
            raise UsageError(f"--watch and {name} exclude each other: every session has a folder of its own")
    if asked.open_:
        raise UsageError("--watch and --open exclude each other: every session has a page of its own")
    if asked.wanted.shard != (1, 1):
        raise UsageError("--watch and --shard exclude each other")
    home = asked.root or default_root(asked.paths)
    watching = WatchState(lambda: discover(asked.paths, home), asked.paths)
    code, seen = _run_in_child(replace(asked, root=home), watching)
    while code not in STOPPED:
        _print_status(watching)
        files = _next(watching, seen)
        if files is None:
            break
        again = replace(asked, paths=files, root=home, last_failed=False)
        code, seen = _run_in_child(again, watching)
    return code


def _run_in_child(asked: SessionRequest, watching: WatchState) -> tuple[int, FileStamps]:
    """One session in a process of its own: its exit code, and the files as they were before it began."""
    before = file_stamps(watching.files)
    reading, writing = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid == 0:
        os.close(reading)
        with os.fdopen(writing, "w", encoding="utf-8") as told:
            report = WatchReporter(told)
            try:
                sys.exit(execute_session(asked, report))
            except InvalidInput as error:
                report.mistakes(error.problems)
                raise
    os.close(writing)
    with _ignoring_interrupts(), os.fdopen(reading, encoding="utf-8") as lines:
        watching.begin(asked.paths)
        for line in lines:
            watching.learn(line)
        code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    watching.end(code)
    now = file_stamps(watching.files)
    return code, {**now, **{file: stamp for file, stamp in before.items() if file in now}}


@contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    """Ctrl-C is for the session, which has it, too; its exit code says so."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _print_status(watching: WatchState) -> None:
    failed = len(watching.failed)
    keys = f"a = all, f = what did not pass ({failed}), q = quit"
    print_text(f"watching {len(watching.files)} files of {len(watching.scenarios)} scenarios: {keys}")
    sys.stdout.flush()


def _next(watching: WatchState, seen: FileStamps) -> Sequence[Path] | None:
    """The scenarios to run next, as soon as a key or a saved file says so; None = to quit."""
    with _keys() as keys:
        while True:
            key = keys()
            if key == "q":
                return None
            if key == "a" and watching.scenarios:
                return watching.scenarios
            if key == "f" and watching.failed:
                return watching.failed
            now = file_stamps(watching.files)
            if now == seen:
                continue
            while (later := _stamps_after_pause(watching)) != now:
                now = later
            changed = {file for file in {*now, *seen} if now.get(file) != seen.get(file)}
            seen = now
            if touched := watching.touched(changed):
                return touched


def _stamps_after_pause(watching: WatchState) -> FileStamps:
    """The files after another pause."""
    select.select([], [], [], POLL_INTERVAL_S)
    return file_stamps(watching.files)


@contextmanager
def _keys() -> Iterator["_Keys"]:
    """What is typed, key by key and without being shown; the terminal is left as it was."""
    if not os.isatty(0):
        yield _Keys()
        return
    before = termios.tcgetattr(0)
    tty.setcbreak(0, termios.TCSANOW)
    try:
        yield _Keys()
    finally:
        termios.tcsetattr(0, termios.TCSANOW, before)


class _Keys:
    """Called, it waits a little for a key; "" = none. Where standard input has ended there will be none."""

    _ended = False

    def __call__(self) -> str:
        readable, _, _ = select.select([] if self._ended else [0], [], [], POLL_INTERVAL_S)
        if not readable:
            return ""
        key = os.read(0, 1).decode("latin-1")
        self._ended = not key
        return key
