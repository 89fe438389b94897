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

    description: str
    code: int
    output: str


class ForkServerProcess:
    """Starts a fork server; `close` ends it and all of its workers.

    All waits have a time limit, so that a hanging fork server cannot block the session.
    """

    def __init__(self, entry: Sequence[str]) -> None:
        self._output = TemporaryFile()  # noqa: SIM115 - stays open as long as the process runs
        self._receive_pipe, replies = os.pipe()
        jobs, self._send_pipe = os.pipe()
        self._process = subprocess.Popen(
            [sys.executable, "-I", *entry, str(replies)],
            stdin=jobs,
            stdout=self._output,
            stderr=self._output,
            pass_fds=[replies],
            env=clean_environment(),
            start_new_session=True,
        )
        os.close(replies)
        os.close(jobs)
        os.set_blocking(self._send_pipe, False)
        self._send_buffer, self._receive_buffer = bytearray(), bytearray()

    def send(self, data: bytes) -> None:
        """Send a message, as soon as the pipe has room."""
        self._send_buffer += data

    def receive_line(self, timeout: float) -> bytes:
        """Return the next line. Raises EOFError if the process has exited, Unresponsive after `timeout` seconds."""
        end = time.monotonic() + timeout
        while b"\n" not in self._receive_buffer:
            readable, writable, _ = select.select(
                [self._receive_pipe],
                [self._send_pipe] if self._send_buffer else [],
                [],
                max(0.0, end - time.monotonic()),
            )
            if writable:
                self._flush()
            if readable:
                self._receive_buffer += self._read()
            elif not writable and time.monotonic() >= end:
                raise Unresponsive
        text, _, rest = bytes(self._receive_buffer).partition(b"\n")
        self._receive_buffer = bytearray(rest)
        return text

    def _flush(self) -> None:
        try:
            del self._send_buffer[: os.write(self._send_pipe, self._send_buffer[:READ_BYTES])]
        except BrokenPipeError:  # it has exited; its last messages can still be read
            self._send_buffer.clear()

    def _read(self) -> bytes:
        data = os.read(self._receive_pipe, READ_BYTES)
        if not data:
            raise EOFError
        return data

    def close(self) -> None:
        """Close the input of the fork server, so that it kills its workers and exits; kill it if it does not exit."""
        os.close(self._send_pipe)
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._kill()
        os.close(self._receive_pipe)
        self._output.close()

    def abort(self) -> None:
        """Make the fork server dump its Python stack and exit."""
        self._process.send_signal(signal.SIGABRT)

    def collect_death(self) -> ProcessDeath:
        """Return how the process ended; kill it if it does not end within a second."""
        try:
            self._process.wait(timeout=1)
        except subprocess.TimeoutExpired:
            self._kill()
        size = os.fstat(self._output.fileno()).st_size
        output = os.pread(self._output.fileno(), TAIL_BYTES, max(0, size - TAIL_BYTES))
        code = self._process.returncode
        description = f"was killed ({signal.Signals(-code).name})" if code < 0 else f"exited {code}"
        return ProcessDeath(description, code, output.decode(errors="replace"))

    def _kill(self) -> None:
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
