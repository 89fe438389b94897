"""Supervisor: sends jobs to the fork server, follows their progress, and reports exactly one end for each.

The supervisor never imports PyBullet or OMPL, so that a crash in these cannot end it.
"""

import json
import signal
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from simscen.run.process.fork_server_process import ForkServerProcess, ProcessDeath, Unresponsive
from simscen.run.process.jobs import ForkServerDeath, Job, ProcessEnd, pack_job

MAX_SILENCE_S = 30.0
"""Time without a message after which the fork server counts as dead. It sends a heartbeat each second."""


@dataclass(frozen=True)
class Started:
    """A job has started."""

    job: Job


@dataclass(frozen=True)
class Progressed:
    """A job has reached a simulated time in seconds."""

    job: Job
    seconds: float


@dataclass(frozen=True)
class Ended:
    """The worker process of a job has ended, or the fork server has died."""

    job: Job
    end: ProcessEnd | ForkServerDeath


class Interrupted(BaseException):
    """The session was interrupted by the signal `number`."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


JobUpdate = Started | Progressed | Ended


def supervise(
    jobs: Iterable[Job], workers: int, entry: Sequence[str], go_on: Callable[[], bool]
) -> Iterator[JobUpdate]:
    """Run all jobs, `workers` at a time, and yield their updates.

    `entry` are the Python arguments that start the fork server, e.g. `-m module`. `go_on` is called before each job.
    If the consumer stops early or an exception passes through, all running processes are killed.
    """
    return Supervisor(jobs, workers, entry, go_on).happenings()


class Supervisor:
    """Runs jobs in worker processes of a fork server, which is restarted if it dies.

    If the fork server dies while it prepares a job, this job fails, and the others that were running are repeated.
    Otherwise any running job may be the cause: these are suspects, each of which is repeated alone and fails if the
    fork server dies again.
    """

    def __init__(self, jobs: Iterable[Job], workers: int, entry: Sequence[str], go_on: Callable[[], bool]) -> None:
        self._waiting, self._suspects = deque(jobs), deque[Job]()
        self._workers, self._entry, self._go_on = workers, entry, go_on
        self._running: dict[int, Job] = {}
        self._preparing: Job | None = None
        self._begun: set[int] = set()
        self._tried: set[int] = set()
        self._alive = False

    def add(self, job: Job) -> None:
        """Add a job at the end of the queue. An iterator of `happenings` that has ended does not resume."""
        self._waiting.append(job)

    def happenings(self) -> Generator[JobUpdate, None, None]:
        """Yield updates until all jobs have ended. Closing the generator kills all processes."""
        while (self._waiting or self._suspects) and self._go_on():
            self._alive = False
            warm = ForkServerProcess(self._entry)
            try:
                yield from self._converse(warm)
            except EOFError:
                yield from self._after_death(warm.autopsy(), silent=False)
            except Unresponsive:
                warm.abort()
                yield from self._after_death(warm.autopsy(), silent=True)
            finally:
                warm.leave()

    def _converse(self, warm: ForkServerProcess) -> Iterator[JobUpdate]:
        while True:
            while self._go_on() and (job := self._next()):
                self._running[job.number] = job
                warm.send(pack_job(job))
            if not self._running:
                return
            happening = self._understood(warm.hear(self._patience()))
            if happening is not None:
                yield happening

    def _next(self) -> Job | None:
        """Return the job to start now, or None. A suspect runs alone."""
        suspected = self._tried & self._running.keys()
        if self._suspects and not self._running:
            return self._suspects.popleft()
        if self._suspects or suspected or not self._waiting or len(self._running) >= self._workers:
            return None
        return self._waiting.popleft()

    def _patience(self) -> float:
        """Return how long to wait for a message. Preparing a job may take its wall limit, without heartbeats."""
        return MAX_SILENCE_S + (self._preparing.wall_limit if self._preparing else 0.0)

    def _understood(self, text: bytes) -> JobUpdate | None:
        message: dict[str, Any] = json.loads(text)
        match message:
            case {"started": number}:
                self._preparing = self._running[number]
                if number not in self._begun:
                    self._begun.add(number)
                    return Started(self._running[number])
            case {"prepared": _}:
                self._preparing = None
            case {"job": number, "seconds": seconds}:
                return Progressed(self._running[number], seconds)
            case {"exit": number}:
                del message["exit"]
                return Ended(self._running.pop(number), ProcessEnd(number=number, **message))
            case _:
                self._alive = True
        return None

    def _after_death(self, death: ProcessDeath, silent: bool) -> Iterator[JobUpdate]:
        """Report the jobs that caused the death as ended, and queue the others again."""
        under_way, prepared = list(self._running.values()), self._preparing
        self._running.clear()
        self._preparing = None
        # A SIGKILL comes from outside, perhaps from another job; other exits are caused by the fork server itself.
        culprit = prepared if silent or death.code != -signal.SIGKILL or len(under_way) == 1 else None
        how = f"did not answer and {death.how}" if silent else death.how
        if not self._alive:  # it cannot even start
            under_way += [*self._suspects, *self._waiting]
            self._suspects.clear()
            self._waiting.clear()
        for job in under_way:
            if job is culprit or job.number in self._tried or not self._alive:
                yield Ended(job, ForkServerDeath(how, job is prepared, silent and job is culprit, death.printed))
            elif culprit is not None:
                self._waiting.appendleft(job)
            else:
                self._tried.add(job.number)
                self._suspects.append(job)


class OnDemandRunner:
    """Runs single jobs on demand, each in a worker process; imports and built worlds are reused.

    `entry` are the Python arguments that start the fork server. Use as a context manager, which ends it.
    """

    def __init__(self, entry: Sequence[str]) -> None:
        self._supervisor = Supervisor((), 1, entry, lambda: True)
        self._happenings: Generator[JobUpdate, None, None] | None = None

    def __enter__(self) -> "OnDemandRunner":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(self, job: Job) -> ProcessEnd | ForkServerDeath:
        """Run a job and return how its process ended. An exception, such as Ctrl-C, ends the fork server."""
        self._supervisor.add(job)
        if self._happenings is None:
            self._happenings = self._supervisor.happenings()
        try:
            return next(one.end for one in self._happenings if isinstance(one, Ended) and one.job is job)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the fork server if it runs."""
        if self._happenings is not None:
            self._happenings.close()
            self._happenings = None
