"""A worker as the warm process sees it: its pipes, its deadline and its end."""

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
"""Bytes of one message; a longer one is none of a worker's."""

DUMP_TIME_S = 0.5
TERM_GRACE_S = 2.0
"""Seconds between SIGTERM and SIGKILL for a run that has exceeded its wall limit."""

TAIL_BYTES = 16_384
_F_SETPIPE_SZ = 1031  # Linux; in Python's fcntl from 3.10 on only where it was built with it

_ENDING = ((signal.SIGUSR1, DUMP_TIME_S), (signal.SIGTERM, TERM_GRACE_S), (signal.SIGKILL, TERM_GRACE_S))
"""How a run beyond its limit is ended: the worker dumps its Python stack, may leave by itself, is killed."""

Hear = Callable[[dict[str, Any]], None]


class WorkerHandle:
    """One worker. `hear` gets its signs of life; its last word is kept for `end`."""

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
        """Take in what the worker tells; False at the end of its pipe."""
        data = os.read(self.report, READ_BYTES)
        self._words += data
        *lines, rest = self._words.split(b"\n")
        self._words = bytearray(rest[:MAX_MESSAGE_BYTES])
        for text in lines:
            self._understand(bytes(text))
        return bool(data)

    def read_print(self) -> bool:
        """Take in what the worker prints; False at the end of its pipe."""
        data = os.read(self.printed, READ_BYTES)
        self._log.take(data)
        return bool(data)

    def _understand(self, text: bytes) -> None:
        """Stray bytes of a library, or of memory gone wrong, are no message: a run without a last word is an error."""
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
        """Its time is up: take the next step to end it."""
        how, patience = next(self._steps, _ENDING[-1])
        self._killed_for, self.deadline = "timeout", time.monotonic() + patience
        if how is signal.SIGUSR1:
            signal.pidfd_send_signal(self.pidfd, how)
        else:
            self.kill(how)

    def kill(self, how: signal.Signals = signal.SIGKILL) -> None:
        """Signal the worker and all of its group."""
        try:
            os.killpg(self.pid, how)
        except ProcessLookupError:
            # It was killed before it could make its own group.
            os.kill(self.pid, how)

    def let_go(self) -> None:
        """Close what this process holds of it."""
        for descriptor in (self.pidfd, self.report, self.printed):
            os.close(descriptor)

    def end(self, status: int, cpu: float, peak_bytes: int) -> dict[str, Any]:
        """Say how it ended, when it has been reaped and can write no more."""
        for read in (self.listen, self.read_print):
            try:
                while read():
                    pass
            except BlockingIOError:  # what it left behind holds the pipe open
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
    """Let a pipe hold more than 64 KiB, so that a run need not wait while the warm process prepares another."""
    with suppress(OSError):  # the user's share of pipe memory is used up: it works with less, too
        fcntl.fcntl(pipe, _F_SETPIPE_SZ, READ_BYTES)
