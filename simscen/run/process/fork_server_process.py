"""Interface of the supervisor to the fork server: start the process, exchange messages, and end the process."""

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from tempfile import TemporaryFile
from typing import NamedTuple

from simscen.run.process.captured_output import TAIL_BYTES, signal_name
from simscen.run.process.isolation import clean_environment

PIPE_BYTES = 1 << 16
"""Maximum number of bytes that are written to or read from a pipe at once."""


class Unresponsive(Exception):
    """Exception: the fork server has sent no message for too long."""


class ProcessDeath(NamedTuple):
    """End of the fork server: a description, the return code of Popen, and the last part of its output."""

    description: str
    code: int
    output: str


class ForkServerProcess:
    """A fork server and the pipes to it. `close` ends the fork server and all of its workers."""

    def __init__(self, entry: Sequence[str]) -> None:
        """Start the fork server. `entry` are its Python arguments, such as `-m module`."""
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
        self._is_used, self._is_closed = False, False

    def send(self, data: bytes) -> None:
        """Queue a message. `receive_line` sends it."""
        self._is_used = True
        self._send_buffer += data

    def receive_line(self, timeout: float) -> bytes:
        """Send queued messages, and return the next received message.

        Raises EOFError if the process has exited, and Unresponsive after `timeout` seconds.
        """
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
                data = os.read(self._receive_pipe, PIPE_BYTES)
                if not data:
                    raise EOFError
                self._receive_buffer += data
            elif not writable and time.monotonic() >= end:
                raise Unresponsive
        text, _, rest = bytes(self._receive_buffer).partition(b"\n")
        self._receive_buffer = bytearray(rest)
        return text

    def _flush(self) -> None:
        try:
            del self._send_buffer[: os.write(self._send_pipe, self._send_buffer[:PIPE_BYTES])]
        except BrokenPipeError:  # the process has exited; its last messages can still be read
            self._send_buffer.clear()

    def close(self) -> None:
        """End the fork server and its workers. Kills a fork server that got no jobs, or that does not exit in time.

        Has no effect after the first call.
        """
        if self._is_closed:
            return
        self._is_closed = True
        os.close(self._send_pipe)
        try:
            self._process.wait(timeout=5 if self._is_used else 0)
        except subprocess.TimeoutExpired:
            self._kill()
        os.close(self._receive_pipe)
        self._output.close()

    def abort(self) -> None:
        """Make the fork server write its Python traceback and exit."""
        self._process.send_signal(signal.SIGABRT)

    def collect_death(self) -> ProcessDeath:
        """Wait up to one second for the end of the process, kill it if it still runs, and return how it ended."""
        try:
            self._process.wait(timeout=1)
        except subprocess.TimeoutExpired:
            self._kill()
        size = os.fstat(self._output.fileno()).st_size
        output = os.pread(self._output.fileno(), TAIL_BYTES, max(0, size - TAIL_BYTES))
        code = self._process.returncode
        description = f"was killed ({signal_name(-code)})" if code < 0 else f"exited {code}"
        return ProcessDeath(description, code, output.decode(errors="replace"))

    def _kill(self) -> None:
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
