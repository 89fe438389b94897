"""Interface of the fork server to a worker process: messages, output, and termination."""

import json
import os
import signal
import time
from collections.abc import Callable
from typing import Any

from simscen.run.process.captured_output import READ_BYTES, TAIL_BYTES, CappedLog
from simscen.run.process.jobs import Job

MAX_MESSAGE_BYTES = 1 << 20
"""Maximum size of a message from a worker."""
_TERMINATION_STEPS = ((signal.SIGUSR1, 0.5), (signal.SIGTERM, 2.0), (signal.SIGKILL, 2.0))
"""Signals that end a worker at its wall-time limit, each with the time in s until the next one.

SIGUSR1 makes the worker write its Python traceback.
"""


class WorkerHandle:
    """A running worker process, its pipes, and its deadline.

    `report` is the pipe for messages of the worker. `output` is the pipe for its standard output and error, which are
    copied to `log`. `send_message` forwards progress messages to the supervisor.
    """

    def __init__(
        self,
        job: Job,
        pid: int,
        report: int,
        output: int,
        log: CappedLog,
        send_message: Callable[[dict[str, Any]], None],
    ) -> None:
        self.job, self.pid, self.pidfd, self.report, self.output = job, pid, os.pidfd_open(pid), report, output
        self._start_time = time.monotonic()
        self.deadline = self._start_time + job.wall_limit
        self._log, self._send_message = log, send_message
        self._buffer = bytearray()
        self._final_message: dict[str, Any] | None = None
        self._left_processes = False
        self._steps = iter(_TERMINATION_STEPS)
        self._killed_for: str | None = None
        for end in (report, output):
            os.set_blocking(end, False)

    def read_messages(self) -> bool:
        """Read and process messages of the worker; return False at the end of the pipe."""
        data = os.read(self.report, READ_BYTES)
        self._buffer += data
        *lines, rest = self._buffer.split(b"\n")
        self._buffer = bytearray(rest[:MAX_MESSAGE_BYTES])
        for text in lines:
            self._process_message(bytes(text))
        return bool(data)

    def read_output(self) -> bool:
        """Read output of the worker and append it to its log; return False at the end of the pipe."""
        data = os.read(self.output, READ_BYTES)
        self._log.append(data)
        return bool(data)

    def _process_message(self, text: bytes) -> None:
        """Process a message of the worker. Ignores invalid messages."""
        try:
            message = json.loads(text)
        except (ValueError, RecursionError):
            return
        match message:
            case {"end": dict(content), "left_processes": bool(left_processes)}:
                self._final_message, self._left_processes = content, left_processes
            case {"seconds": int() | float() as seconds}:
                self._send_message({"job": self.job.number, "seconds": seconds})

    def escalate(self) -> None:
        """Send the next signal of _TERMINATION_STEPS to a worker that exceeded its deadline."""
        signal_number, timeout = next(self._steps, _TERMINATION_STEPS[-1])
        self._killed_for, self.deadline = "timeout", time.monotonic() + timeout
        if signal_number is signal.SIGUSR1:
            signal.pidfd_send_signal(self.pidfd, signal_number)
        else:
            self.kill(signal_number)

    def kill(self, signal_number: signal.Signals = signal.SIGKILL) -> None:
        """Send a signal to the worker and its process group."""
        try:
            os.killpg(self.pid, signal_number)
        except ProcessLookupError:
            # The worker was killed before it created its own group.
            os.kill(self.pid, signal_number)

    def close_descriptors(self) -> None:
        """Close the file descriptors of the worker."""
        for descriptor in (self.pidfd, self.report, self.output):
            os.close(descriptor)

    def exit_message(self, status: int, cpu: float, peak_bytes: int) -> dict[str, Any]:
        """Close the pipes of a reaped worker, and return the message about its end.

        `status` is the wait status of the process, `cpu` its processor time in s, and `peak_bytes` its peak memory. The
        message has the fields of jobs.ProcessEnd, and the number of the job with the key `exit`.
        """
        for read in (self.read_messages, self.read_output):
            try:
                while read():
                    pass
            except BlockingIOError:  # a descendant of the worker keeps the pipe open
                pass
        self.close_descriptors()
        self._log.close()
        return {
            "exit": self.job.number,
            "code": os.WEXITSTATUS(status) if os.WIFEXITED(status) else None,
            "signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else None,
            "killed_for": self._killed_for,
            "final_message": self._final_message,
            "wall": time.monotonic() - self._start_time,
            "cpu": cpu,
            "peak_bytes": peak_bytes,
            "left_processes": self._left_processes,
            "output": self._log.tail(TAIL_BYTES).decode(errors="replace"),
        }
