"""The warm process: it has its imports done and its worlds built, and forks one process for each run.

It never creates a bullet client or an OMPL object, so that every fork starts from the same blank state. It speaks
with the supervisor over two pipes: jobs come in pickled, one line of JSON goes back for each thing that happens.
"""

import contextlib
import json
import os
import selectors
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from simscen.run.confine import die_with_parent
from simscen.run.jobs import Job, line, receive_job
from simscen.run.worker import Perform, be_worker

GRACE = 2.0
"""Seconds between SIGTERM and SIGKILL for a run that has exceeded its wall limit."""


@dataclass
class _Child:
    job: Job
    pid: int
    pidfd: int
    report: int
    started: float
    deadline: float
    killed_for: str | None = None
    words: bytearray = field(default_factory=bytearray)
    end: dict[str, Any] | None = None


class Zygote:
    """Serves jobs until its input ends, then kills what is still running."""

    def __init__(self, jobs: IO[bytes], replies: int, warm_up: Callable[[Job], object], perform: Perform) -> None:
        self._jobs, self._replies, self._warm_up, self._perform = jobs, replies, warm_up, perform
        self._selector = selectors.DefaultSelector()
        self._children: dict[int, _Child] = {}

    def serve(self) -> None:
        """Take jobs and look after children until the supervisor closes its end."""
        die_with_parent(os.getppid())
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        self._selector.register(self._jobs, selectors.EVENT_READ, self._take_job)
        while True:
            for key, _ in self._selector.select(self._next_deadline()):
                if key.data() is False:
                    self._kill_all()
                    return
            self._enforce_deadlines()

    def _take_job(self) -> bool:
        job = receive_job(self._jobs)
        if job is None:
            return False
        self._tell({"started": job.number})
        # A mistake is met again in the run's own process, where it is reported as that run's error.
        with contextlib.suppress(Exception), _at_most(job.wall_limit):
            self._warm_up(job)
        self._fork(job)
        return True

    def _fork(self, job: Job) -> None:
        parent = os.getpid()
        report, told = os.pipe()
        pid = os.fork()
        if pid == 0:
            self._forget_everything(keep=told)
            be_worker(job, parent, told, self._perform)
        os.close(told)
        now = time.monotonic()
        child = _Child(job, pid, os.pidfd_open(pid), report, now, now + job.wall_limit)
        self._children[pid] = child
        self._selector.register(report, selectors.EVENT_READ, lambda: self._listen(child))
        self._selector.register(child.pidfd, selectors.EVENT_READ, lambda: self._bury(child))

    def _forget_everything(self, keep: int) -> None:
        """In the child: close what belongs to the zygote and to the other children."""
        self._selector.close()
        for child in self._children.values():
            os.close(child.report)
            os.close(child.pidfd)
        self._jobs.close()
        if self._replies != keep:
            os.close(self._replies)

    def _listen(self, child: _Child) -> bool:
        """Pass on what the child tells."""
        data = os.read(child.report, 65536)
        if not data:
            self._selector.unregister(child.report)
            return True
        child.words += data
        *lines, rest = child.words.split(b"\n")
        child.words = bytearray(rest)
        for text in lines:
            self._hear(child, bytes(text))
        return True

    def _hear(self, child: _Child, text: bytes) -> None:
        message = json.loads(text)
        if "end" in message:
            child.end = message["end"]
        else:
            self._tell({"job": child.job.number, **message})

    def _bury(self, child: _Child) -> bool:
        """The child is dead but not yet reaped: its group can still be killed without hitting a stranger."""
        self._selector.unregister(child.pidfd)
        self._drain(child)
        left = _group_has_others(child.pid)
        _kill_group(child.pid, signal.SIGKILL)
        _, status, usage = os.wait4(child.pid, 0)
        os.close(child.pidfd)
        os.close(child.report)
        del self._children[child.pid]
        self._tell(
            {
                "exit": child.job.number,
                "code": os.WEXITSTATUS(status) if os.WIFEXITED(status) else None,
                "signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else None,
                "killed_for": child.killed_for,
                "last_word": child.end,
                "wall": time.monotonic() - child.started,
                "cpu": usage.ru_utime + usage.ru_stime,
                "peak_bytes": usage.ru_maxrss * 1024,
                "left_processes": left,
            }
        )
        return True

    def _drain(self, child: _Child) -> None:
        """Read what is left in the pipe; a grandchild may hold it open, so never wait for its end."""
        if child.report in self._selector.get_map():
            self._selector.unregister(child.report)
        os.set_blocking(child.report, False)
        try:
            while data := os.read(child.report, 65536):
                child.words += data
        except BlockingIOError:
            pass
        for text in bytes(child.words).split(b"\n")[:-1]:
            self._hear(child, text)

    def _next_deadline(self) -> float | None:
        deadlines = [child.deadline for child in self._children.values()]
        return max(0.0, min(deadlines) - time.monotonic()) if deadlines else None

    def _enforce_deadlines(self) -> None:
        now = time.monotonic()
        for child in self._children.values():
            if now >= child.deadline:
                _kill_group(child.pid, signal.SIGKILL if child.killed_for else signal.SIGTERM)
                child.killed_for, child.deadline = "timeout", now + GRACE

    def _kill_all(self) -> None:
        for child in self._children.values():
            _kill_group(child.pid, signal.SIGKILL)

    def _tell(self, message: dict[str, Any]) -> None:
        os.write(self._replies, line(message))


def _kill_group(leader: int, how: signal.Signals) -> None:
    try:
        os.killpg(leader, how)
    except ProcessLookupError:
        # The child was killed before it could make its own group.
        os.kill(leader, how)


def _group_has_others(leader: int) -> bool:
    """Whether any process but the leader is in its group (Linux: field 5 of /proc/PID/stat)."""
    for entry in os.scandir("/proc"):
        if entry.name.isdigit() and int(entry.name) != leader:
            try:
                stat = Path(entry.path, "stat").read_text()
            except OSError:
                continue  # it has ended meanwhile
            if int(stat.rsplit(")", 1)[1].split()[2]) == leader:
                return True
    return False


@contextlib.contextmanager
def _at_most(seconds: float) -> Iterator[None]:
    """Raise TimeoutError inside a block that takes longer: nobody else watches over the warm process."""

    def ring(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
