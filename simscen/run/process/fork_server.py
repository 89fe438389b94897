"""Fork server: imports PyBullet and OMPL and builds worlds once, then forks a worker process for each run.

The fork server receives pickled messages from the supervisor over one pipe: a plug-in path, if there are plug-ins, and
jobs. It sends messages, one line of JSON each, over another pipe.
"""

import faulthandler
import fcntl
import gc
import os
import selectors
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

from simscen.run.process.captured_output import READ_BYTES, CappedLog
from simscen.run.process.isolation import (
    adopt_orphans,
    apply_plugin_path,
    die_with_parent,
    kill_children_except,
    limit_memory,
)
from simscen.run.process.jobs import Job, json_line, receive_message
from simscen.run.process.worker import ExecuteJob, run_worker
from simscen.run.process.worker_handle import WorkerHandle

_F_SETPIPE_SZ = 1031  # of Linux; missing in some builds of Python

HEARTBEAT_S = 1.0
"""Maximum time between two messages to the supervisor, except while the fork server prepares a scenario."""


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
            deadlines = [child.deadline - time.monotonic() for child in self._children.values()]
            for key, _ in self._selector.select(max(0.0, min([HEARTBEAT_S, *deadlines]))):
                if key.fileobj == self._jobs:
                    if not self._process_message():
                        self._kill_all()
                        return
                elif self._selector.get_map().get(key.fileobj) is key:  # no earlier event has closed the descriptor
                    key.data()
            now = time.monotonic()
            for child in self._children.values():
                if now >= child.deadline:
                    child.escalate()

    def _process_message(self) -> bool:
        """Receive a message and process it; return False at the end of the pipe."""
        match receive_message(self._jobs):
            case None:
                return False
            case str() as plugin_path:
                apply_plugin_path(plugin_path)
            case Job() as job:
                self._start_job(job)
        return True

    def _start_job(self, job: Job) -> None:
        """Prepare the scenario of a job, and fork its worker."""
        self._send({"started": job.number})
        log = CappedLog(job.folder / "worker.log")
        # An error occurs again in the worker, which reports it as the error of the run.
        with suppress(Exception, SystemExit), _time_limit(job.wall_limit):
            self._warm_up(job)
        log.append(_take_own_output())
        self._fork(job, log)
        self._send({"prepared": job.number})

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
