"""Fork server: imports the engines and builds worlds once, then forks a worker process for each run.

It never creates an OMPL object and never steps a Bullet client, so that every worker starts from the same state. It
receives pickled jobs from the supervisor over one pipe and sends one line of JSON per message over another.
"""

import contextlib
import faulthandler
import fcntl
import gc
import json
import os
import selectors
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

from simscen.run.process.captured_output import READ_BYTES, CappedLog
from simscen.run.process.isolation import adopt_orphans, die_with_parent, kill_children_except, limit_memory
from simscen.run.process.jobs import Job, json_line, receive_job
from simscen.run.process.worker import ExecuteJob, WorkerPipes, run_worker

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
