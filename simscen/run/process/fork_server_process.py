"""Process handle of the fork server in the supervisor."""

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
    """The fork server sent no message for too long."""


class ProcessDeath(NamedTuple):
    """How the fork server ended: description, return code of Popen, and the end of its output."""

    how: str
    code: int
    printed: str


class ForkServerProcess:
    """Starts a fork server; `leave` ends it and all of its workers.

    All waits have a time limit, so that a hanging fork server cannot block the session.
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
        """Send a message, as soon as the pipe has room."""
        self._outbox += data

    def hear(self, patience: float) -> bytes:
        """Return the next line. Raises EOFError if the process has exited, Unresponsive after `patience` seconds."""
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
        except BrokenPipeError:  # it has exited; its last messages can still be read
            self._outbox.clear()

    def _received(self) -> bytes:
        data = os.read(self._hear, READ_BYTES)
        if not data:
            raise EOFError
        return data

    def leave(self) -> None:
        """Close its input, so that it kills its workers and exits; kill it if it does not."""
        os.close(self._send)
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._kill()
        os.close(self._hear)
        self._printed.close()

    def abort(self) -> None:
        """Make it dump its stack and exit."""
        self._process.send_signal(signal.SIGABRT)

    def autopsy(self) -> ProcessDeath:
        """Return how the process ended; kill it if it does not end within a second."""
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
