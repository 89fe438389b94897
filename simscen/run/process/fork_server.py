"""Fork server: imports PyBullet and OMPL and builds worlds once, then forks a worker process for each run.

The fork server receives pickled jobs from the supervisor over one pipe, and sends messages, one line of JSON each, over
another pipe.
"""

import faulthandler
import fcntl
import gc
import json
import os
import selectors
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

from simscen.run.process.isolation import (
    READ_BYTES,
    TAIL_BYTES,
    CappedLog,
    adopt_orphans,
    die_with_parent,
    kill_children_except,
    limit_memory,
)
from simscen.run.process.jobs import Job, json_line, receive_job
from simscen.run.process.worker import ExecuteJob, run_worker

MAX_MESSAGE_BYTES = 1 << 20
"""Maximum size of a message from a worker."""
_F_SETPIPE_SZ = 1031  # Linux; missing in Python's fcntl before 3.10 and in some builds

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
        self.started = time.monotonic()
        self.deadline = self.started + job.wall_limit
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
            except BlockingIOError:  # a process it left behind keeps the pipe open
                pass
        self.close_descriptors()
        self._log.close()
        return {
            "exit": self.job.number,
            "code": os.WEXITSTATUS(status) if os.WIFEXITED(status) else None,
            "signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else None,
            "killed_for": self._killed_for,
            "final_message": self._final_message,
            "wall": time.monotonic() - self.started,
            "cpu": cpu,
            "peak_bytes": peak_bytes,
            "left_processes": self._left_processes,
            "output": self._log.tail(TAIL_BYTES).decode(errors="replace"),
        }


HEARTBEAT_S = 1.0
"""Longest time between two messages to the supervisor, except while the fork server prepares a scenario."""


class ForkServer:
    """Prepares jobs, and forks a worker process for each job."""

    def __init__(self, jobs: int, replies: int, warm_up: Callable[[Job], object], execute: ExecuteJob) -> None:
        """`jobs` and `replies` are the file descriptors of the pipes from and to the supervisor.

        `warm_up` prepares the scenario of a job before the fork. `execute` runs the job in the worker.
        """
        self._jobs, self._replies, self._warm_up, self._execute = jobs, replies, warm_up, execute
        self._selector = selectors.DefaultSelector()
        self._children: dict[int, WorkerHandle] = {}

    def serve(self) -> None:
        """Run jobs until the supervisor closes the pipe, then kill all workers."""
        die_with_parent(os.getppid())
        faulthandler.enable()
        limit_memory()
        adopt_orphans()
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        self._selector.register(self._jobs, selectors.EVENT_READ)
        while True:
            self._send({"alive": True})
            for key, _ in self._selector.select(self._select_timeout()):
                if key.fileobj == self._jobs:
                    if not self._start_job():
                        self._kill_all()
                        return
                elif self._selector.get_map().get(key.fileobj) is key:  # no earlier event has closed the descriptor
                    key.data()
            now = time.monotonic()
            for child in self._children.values():
                if now >= child.deadline:
                    child.escalate()

    def _start_job(self) -> bool:
        """Receive a job, prepare its scenario, and fork its worker; return False at the end of the pipe."""
        job = receive_job(self._jobs)
        if job is None:
            return False
        self._send({"started": job.number})
        log = CappedLog(job.folder / "worker.log")
        # An error occurs again in the worker, which reports it as the error of the run.
        with suppress(Exception, SystemExit), _time_limit(job.wall_limit):
            self._warm_up(job)
        log.append(_take_own_output())
        self._fork(job, log)
        self._send({"prepared": job.number})
        return True

    def _fork(self, job: Job, log: CappedLog) -> None:
        """Fork the worker of a job, and watch its pipes and its exit."""
        parent = os.getpid()
        report_reader, report_writer = os.pipe()
        output_reader, output_writer = os.pipe()
        gc.freeze()  # exclude existing objects from garbage collection, which would copy their memory in the worker
        pid = os.fork()
        if pid == 0:
            self._close_inherited_descriptors()
            run_worker(job, parent, report_writer, output_writer, self._execute)
        gc.unfreeze()
        os.close(report_writer)
        os.close(output_writer)
        # A larger buffer, so that the worker can write while the fork server prepares a scenario.
        with suppress(OSError):  # the user's limit of pipe memory is reached; a smaller buffer works as well
            fcntl.fcntl(output_reader, _F_SETPIPE_SZ, READ_BYTES)
        child = WorkerHandle(job, pid, report_reader, output_reader, log, self._send)
        self._children[pid] = child
        for pipe, read in ((report_reader, child.read_messages), (output_reader, child.read_output)):
            self._selector.register(pipe, selectors.EVENT_READ, partial(self._read, pipe, read))
        self._selector.register(child.pidfd, selectors.EVENT_READ, partial(self._reap, child))

    def _close_inherited_descriptors(self) -> None:
        """Close the file descriptors of the fork server and of other workers. Called in the worker."""
        self._selector.close()
        for child in self._children.values():
            child.close_descriptors()
        os.close(self._jobs)
        os.close(self._replies)

    def _read(self, pipe: int, read: Callable[[], bool]) -> None:
        """Read from a pipe, and stop watching it at its end."""
        if not read():
            self._selector.unregister(pipe)

    def _reap(self, child: WorkerHandle) -> None:
        """Reap an exited worker, kill its descendants, and report its end."""
        for descriptor in (child.pidfd, child.report, child.output):
            if descriptor in self._selector.get_map():
                self._selector.unregister(descriptor)
        child.kill()
        _, status, usage = os.wait4(child.pid, 0)
        del self._children[child.pid]
        kill_children_except(self._children)
        self._send(child.exit_message(status, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024))

    def _select_timeout(self) -> float:
        """Return the time in s until the next deadline of a worker, at most HEARTBEAT_S."""
        deadlines = [child.deadline - time.monotonic() for child in self._children.values()]
        return max(0.0, min([HEARTBEAT_S, *deadlines]))

    def _kill_all(self) -> None:
        for child in self._children.values():
            child.kill()
            os.waitpid(child.pid, 0)
        kill_children_except(())

    def _send(self, message: dict[str, Any]) -> None:
        os.write(self._replies, json_line(message))


def _take_own_output() -> bytes:
    """Return the output of the fork server since the last call, and truncate the file to which it is redirected."""
    size = os.fstat(2).st_size
    data = os.pread(2, size, 0)
    os.ftruncate(2, 0)
    os.lseek(2, 0, os.SEEK_SET)
    return data


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeoutError inside a `with` block that takes longer than `seconds`."""

    def raise_timeout(*_: object) -> None:
        raise TimeoutError

    previous = signal.signal(signal.SIGALRM, raise_timeout)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
