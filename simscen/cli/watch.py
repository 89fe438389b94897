"""`simscen run --watch`: stay, and run again what a saved file touches."""

import os
import select
import signal
import sys
import termios
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from simscen.cli.diagnostics import print_text
from simscen.cli.runsession import Asked, session
from simscen.cli.select import Selection
from simscen.cli.watching import Report, Stamps, Watching, stamps_of
from simscen.core.errors import Exit, InvalidInput, UsageError
from simscen.loading.discovery import default_root, discover

PAUSE = 0.25
"""Seconds between two looks at the files; two looks that are equal end a burst of saving."""
STOPPED = (Exit.HUNG_UP, Exit.INTERRUPTED, Exit.TERMINATED)


def watched(asked: Asked) -> int:
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
    watching = Watching(lambda: discover(asked.paths, home), asked.paths)
    code, seen = _cycle(replace(asked, root=home), watching)
    while code not in STOPPED:
        _tell(watching)
        files = _next(watching, seen)
        if files is None:
            break
        again = replace(asked, paths=files, root=home, last_failed=False, wanted=_unsharded(asked.wanted))
        code, seen = _cycle(again, watching)
    return code


def _unsharded(wanted: Selection) -> Selection:
    return replace(wanted, shard=(1, 1))


def _cycle(asked: Asked, watching: Watching) -> tuple[int, Stamps]:
    """One session in a process of its own: its exit code, and the files as they were before it began."""
    before = stamps_of(watching.files)
    reading, writing = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid == 0:
        os.close(reading)
        with os.fdopen(writing, "w", encoding="utf-8") as told:
            report = Report(told)
            try:
                sys.exit(session(asked, report))
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
    now = stamps_of(watching.files)
    return code, {**now, **{file: stamp for file, stamp in before.items() if file in now}}


@contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    """Ctrl-C is for the session, which has it, too; its exit code says so."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _tell(watching: Watching) -> None:
    failed = len(watching.failed)
    keys = f"a = all, f = what did not pass ({failed}), q = quit"
    print_text(f"watching {len(watching.files)} files of {len(watching.scenarios)} scenarios: {keys}")
    sys.stdout.flush()


def _next(watching: Watching, seen: Stamps) -> Sequence[Path] | None:
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
            now = stamps_of(watching.files)
            if now == seen:
                continue
            while (later := _settled(watching)) != now:
                now = later
            changed = {file for file in {*now, *seen} if now.get(file) != seen.get(file)}
            seen = now
            if touched := watching.touched(changed):
                return touched


def _settled(watching: Watching) -> Stamps:
    """The files after another pause."""
    select.select([], [], [], PAUSE)
    return stamps_of(watching.files)


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
        readable, _, _ = select.select([] if self._ended else [0], [], [], PAUSE)
        if not readable:
            return ""
        key = os.read(0, 1).decode("latin-1")
        self._ended = not key
        return key
