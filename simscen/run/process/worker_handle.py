"""Handle of a worker process in the fork server: its pipes, its deadline, and its exit."""

import fcntl
import json
import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from simscen.run.process.captured_output import READ_BYTES, CappedLog
from simscen.run.process.jobs import Job

MAX_MESSAGE_BYTES = 1 << 20
"""Longest valid message of a worker."""

DUMP_TIME_S = 0.5
TERM_GRACE_S = 2.0
"""Time between SIGTERM and SIGKILL for a run that exceeded its wall limit."""

TAIL_BYTES = 16_384
_F_SETPIPE_SZ = 1031  # Linux; in Python's fcntl from 3.10 on only where it was built with it

_ENDING = ((signal.SIGUSR1, DUMP_TIME_S), (signal.SIGTERM, TERM_GRACE_S), (signal.SIGKILL, TERM_GRACE_S))
"""Steps to end a run that exceeded its wall limit: dump the Python stack, terminate, kill."""

Hear = Callable[[dict[str, Any]], None]


class WorkerHandle:
    """A worker process. `hear` receives its progress messages; its final message is kept for `end`."""

    def __init__(self, job: Job, pid: int, report: int, printed: int, log: CappedLog, hear: Hear) -> None:
        self.job, self.pid, self.pidfd, self.report, self.printed = job, pid, os.pidfd_open(pid), report, printed
        self.started = time.monotonic()
        self.deadline = self.started + job.wall_limit
        self._log, self._hear = log, hear
        self._words = bytearray()
        self._last_word: dict[str, Any] | None = None
        self._left = False
        self._steps = iter(_ENDING)
        self._killed_for: str | None = None
        for end in (report, printed):
            os.set_blocking(end, False)

    def listen(self) -> bool:
        """Read messages of the worker; return False at the end of the pipe."""
        data = os.read(self.report, READ_BYTES)
        self._words += data
        *lines, rest = self._words.split(b"\n")
        self._words = bytearray(rest[:MAX_MESSAGE_BYTES])
        for text in lines:
            self._understand(bytes(text))
        return bool(data)

    def read_print(self) -> bool:
        """Read output of the worker; return False at the end of the pipe."""
        data = os.read(self.printed, READ_BYTES)
        self._log.take(data)
        return bool(data)

    def _understand(self, text: bytes) -> None:
        """Parse a message. Ignore anything else, such as stray bytes of a library."""
        try:
            message = json.loads(text)
        except (ValueError, RecursionError):
            return
        match message:
            case {"end": dict(word), "left_processes": bool(left)}:
                self._last_word, self._left = word, left
            case {"seconds": int() | float() as seconds}:
                self._hear({"job": self.job.number, "seconds": seconds})

    def press(self) -> None:
        """Take the next step to end a worker that exceeded its deadline."""
        how, patience = next(self._steps, _ENDING[-1])
        self._killed_for, self.deadline = "timeout", time.monotonic() + patience
        if how is signal.SIGUSR1:
            signal.pidfd_send_signal(self.pidfd, how)
        else:
            self.kill(how)

    def kill(self, how: signal.Signals = signal.SIGKILL) -> None:
        """Send a signal to the worker and its process group."""
        try:
            os.killpg(self.pid, how)
        except ProcessLookupError:
            # It was killed before it created its own group.
            os.kill(self.pid, how)

    def let_go(self) -> None:
        """Close the file descriptors of the worker."""
        for descriptor in (self.pidfd, self.report, self.printed):
            os.close(descriptor)

    def end(self, status: int, cpu: float, peak_bytes: int) -> dict[str, Any]:
        """Return the exit message for the supervisor. Call this after the worker was reaped."""
        for read in (self.listen, self.read_print):
            try:
                while read():
                    pass
            except BlockingIOError:  # a process it left behind keeps the pipe open
                pass
        self.let_go()
        self._log.close()
        return {
            "exit": self.job.number,
            "code": os.WEXITSTATUS(status) if os.WIFEXITED(status) else None,
            "signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else None,
            "killed_for": self._killed_for,
            "last_word": self._last_word,
            "wall": time.monotonic() - self.started,
            "cpu": cpu,
            "peak_bytes": peak_bytes,
            "left_processes": self._left,
            "printed": self._log.last(TAIL_BYTES).decode(errors="replace"),
        }


def enlarge_pipe(pipe: int) -> None:
    """Enlarge the buffer of a pipe, so that a worker need not wait while the fork server prepares a scenario."""
    with suppress(OSError):  # the user's limit of pipe memory is reached; a smaller buffer works, too
        fcntl.fcntl(pipe, _F_SETPIPE_SZ, READ_BYTES)
