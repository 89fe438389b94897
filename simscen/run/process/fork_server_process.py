"""The warm process from the outside: what is sent to it, what it says, and how it ended."""

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from tempfile import TemporaryFile
from typing import NamedTuple

from simscen.run.process.isolation import clean_environment

TAIL_BYTES = 16_384
READ_BYTES = 1 << 16


class Unresponsive(Exception):
    """It has said nothing for too long."""


class ProcessDeath(NamedTuple):
    """How it ended, in words and as Popen's return code, and the end of what it printed."""

    how: str
    code: int
    printed: str


class ForkServerProcess:
    """Starts it; `leave` ends it with all that it runs.

    Nothing here waits without an end: neither a stopped process nor one that hangs in C takes the session with it.
    """

    def __init__(self, entry: Sequence[str]) -> None:
        self._printed = TemporaryFile()  # noqa: SIM115 - as long as the process
        self._hear, replies = os.pipe()
        jobs, self._send = os.pipe()
        self._process = subprocess.Popen(
            [sys.executable, "-I", *entry, str(replies)],
            stdin=jobs,
            stdout=self._printed,
            stderr=self._printed,
            pass_fds=[replies],
            env=clean_environment(),
            start_new_session=True,
        )
        os.close(replies)
        os.close(jobs)
        os.set_blocking(self._send, False)
        self._outbox, self._inbox = bytearray(), bytearray()

    def send(self, data: bytes) -> None:
        """Put a message into its pipe as soon as that has room."""
        self._outbox += data

    def hear(self, patience: float) -> bytes:
        """Its next line. Raises EOFError when it has gone, Silent when it says nothing for `patience` seconds."""
        end = time.monotonic() + patience
        while b"\n" not in self._inbox:
            readable, writable, _ = select.select(
                [self._hear], [self._send] if self._outbox else [], [], max(0.0, end - time.monotonic())
            )
            if writable:
                self._post()
            if readable:
                self._inbox += self._received()
            elif not writable and time.monotonic() >= end:
                raise Unresponsive
        text, _, rest = bytes(self._inbox).partition(b"\n")
        self._inbox = bytearray(rest)
        return text

    def _post(self) -> None:
        try:
            del self._outbox[: os.write(self._send, self._outbox[:READ_BYTES])]
        except BrokenPipeError:  # it is dead; what it said before that is still to be heard
            self._outbox.clear()

    def _received(self) -> bytes:
        data = os.read(self._hear, READ_BYTES)
        if not data:
            raise EOFError
        return data

    def leave(self) -> None:
        """Close its input, which makes it kill what is left, and wait for it; one that does not listen is killed."""
        os.close(self._send)
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._kill()
        os.close(self._hear)
        self._printed.close()

    def abort(self) -> None:
        """Let it dump its stack and die."""
        self._process.send_signal(signal.SIGABRT)

    def autopsy(self) -> ProcessDeath:
        """Look at one that is dead, or should be in a second."""
        try:
            self._process.wait(timeout=1)
        except subprocess.TimeoutExpired:
            self._kill()
        size = os.fstat(self._printed.fileno()).st_size
        printed = os.pread(self._printed.fileno(), TAIL_BYTES, max(0, size - TAIL_BYTES))
        code = self._process.returncode
        how = f"was killed ({signal.Signals(-code).name})" if code < 0 else f"exited {code}"
        return ProcessDeath(how, code, printed.decode(errors="replace"))

    def _kill(self) -> None:
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
