"""Fork server: imports the engines and builds worlds once, then forks a worker process for each run.

It never creates an OMPL object and never steps a Bullet client, so that every worker starts from the same state. It
receives pickled jobs from the supervisor over one pipe and sends one line of JSON per message over another.
"""

import contextlib
import faulthandler
import gc
import os
import selectors
import signal
import time
from collections.abc import Callable, Iterator
from typing import Any

from simscen.run.process.captured_output import CappedLog
from simscen.run.process.isolation import adopt_orphans, die_with_parent, kill_children_except, limit_memory
from simscen.run.process.jobs import Job, json_line, receive_job
from simscen.run.process.worker import ExecuteJob, WorkerPipes, run_worker
from simscen.run.process.worker_handle import WorkerHandle, enlarge_pipe

HEARTBEAT_S = 1.0
"""Time between two heartbeats while the fork server is not preparing a scenario."""


class ForkServer:
    """Runs jobs until its input ends, then kills all workers."""

    def __init__(self, jobs: int, replies: int, warm_up: Callable[[Job], object], perform: ExecuteJob) -> None:
        self._jobs, self._replies, self._warm_up, self._perform = jobs, replies, warm_up, perform
        self._selector = selectors.DefaultSelector()
        self._children: dict[int, WorkerHandle] = {}

    def serve(self) -> None:
        """Run jobs and supervise workers until the supervisor closes the pipe."""
        die_with_parent(os.getppid())
        faulthandler.enable()
        limit_memory()
        adopt_orphans()
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        self._selector.register(self._jobs, selectors.EVENT_READ, self._take_job)
        while True:
            self._tell({"alive": True})
            for key, _ in self._selector.select(self._patience()):
                stale = (
                    self._selector.get_map().get(key.fileobj) is not key
                )  # closed while an earlier event was handled
                if not stale and key.data() is False:
                    self._kill_all()
                    return
            self._enforce_deadlines()

    def _take_job(self) -> bool:
        job = receive_job(self._jobs)
        if job is None:
            return False
        self._tell({"started": job.number})
        log = CappedLog(job.folder / "worker.log")
        # An error occurs again in the worker, which reports it as the error of the run.
        with contextlib.suppress(Exception, SystemExit), _at_most(job.wall_limit):
            self._warm_up(job)
        log.take(_printed_meanwhile())
        self._fork(job, log)
        self._tell({"prepared": job.number})
        return True

    def _fork(self, job: Job, log: CappedLog) -> None:
        parent = os.getpid()
        report, told = os.pipe()
        shown, printed = os.pipe()
        gc.freeze()  # exclude existing objects from garbage collection, which would copy their memory in the worker
        pid = os.fork()
        if pid == 0:
            self._forget_everything()
            run_worker(job, parent, WorkerPipes(told, printed), self._perform)
        gc.unfreeze()
        os.close(told)
        os.close(printed)
        enlarge_pipe(shown)
        child = WorkerHandle(job, pid, report, shown, log, self._tell)
        self._children[pid] = child
        self._selector.register(report, selectors.EVENT_READ, lambda: self._read(report, child.listen))
        self._selector.register(shown, selectors.EVENT_READ, lambda: self._read(shown, child.read_print))
        self._selector.register(child.pidfd, selectors.EVENT_READ, lambda: self._bury(child))

    def _forget_everything(self) -> None:
        """Close the file descriptors of the fork server and of other workers. Called in the worker."""
        self._selector.close()
        for child in self._children.values():
            child.let_go()
        os.close(self._jobs)
        os.close(self._replies)

    def _read(self, pipe: int, take: Callable[[], bool]) -> bool:
        if not take():
            self._selector.unregister(pipe)
        return True

    def _bury(self, child: WorkerHandle) -> bool:
        """Reap a worker that has exited, and report its end.

        Its group is killed before it is reaped, because its id could be reused afterwards."""
        for descriptor in (child.pidfd, child.report, child.printed):
            if descriptor in self._selector.get_map():
                self._selector.unregister(descriptor)
        child.kill()
        _, status, usage = os.wait4(child.pid, 0)
        del self._children[child.pid]
        kill_children_except(self._children)
        self._tell(child.end(status, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024))
        return True

    def _patience(self) -> float:
        deadlines = [child.deadline - time.monotonic() for child in self._children.values()]
        return max(0.0, min([HEARTBEAT_S, *deadlines]))

    def _enforce_deadlines(self) -> None:
        now = time.monotonic()
        for child in self._children.values():
            if now >= child.deadline:
                child.press()

    def _kill_all(self) -> None:
        for child in self._children.values():
            child.kill()
            os.waitpid(child.pid, 0)
        kill_children_except(())

    def _tell(self, message: dict[str, Any]) -> None:
        os.write(self._replies, json_line(message))


def _printed_meanwhile() -> bytes:
    """Return and remove the output of this process since the last call; standard error is a file.

    Output during the preparation of a scenario belongs to the log of its run.
    """
    size = os.fstat(2).st_size
    data = os.pread(2, size, 0)
    os.ftruncate(2, 0)
    os.lseek(2, 0, os.SEEK_SET)
    return data


@contextlib.contextmanager
def _at_most(seconds: float) -> Iterator[None]:
    """Raise TimeoutError inside a block that takes longer than `seconds`.

    The supervisor ends a fork server that hangs in C code, which this cannot interrupt.
    """

    def ring(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
