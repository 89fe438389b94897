"""The supervisor: hands jobs to the warm process, hears how they go, and loses none of them.

It never imports an engine, so that nothing an engine does can take it down. Every job it is given yields exactly one
answer: the worker's own last word counts only if its process also exited with status 0 and was not killed by us.
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
"""Seconds without a sign of life after which the warm process is taken for dead; it gives one each second."""


@dataclass(frozen=True)
class Started:
    """A job has begun."""

    job: Job


@dataclass(frozen=True)
class Progressed:
    """A job has got so far, in simulated seconds."""

    job: Job
    seconds: float


@dataclass(frozen=True)
class Ended:
    """A job's process has ended, or the warm process under it."""

    job: Job
    end: ProcessEnd | ForkServerDeath


class Interrupted(BaseException):
    """The user or the system asks to stop; `number` is the signal's."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


JobUpdate = Started | Progressed | Ended


def supervise(
    jobs: Iterable[Job], workers: int, entry: Sequence[str], go_on: Callable[[], bool]
) -> Iterator[JobUpdate]:
    """Run all jobs, `workers` at a time, yielding what happens as it happens.

    `entry` is how Python is called to be the warm process, e.g. `-m module`. `go_on` is asked before each new job.
    When the consumer stops early (or an exception passes through), everything that still runs is killed.
    """
    return Supervisor(jobs, workers, entry, go_on).happenings()


class Supervisor:
    """Jobs wait, run, and are answered.

    When the warm process dies by itself, the job that it was preparing is to blame, and its neighbours run again in
    the next one. Otherwise any of those under way may have killed it: they are `suspects`, each of which runs again by
    itself, and is to blame when that happens again.
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
        """One more job, behind the others; of `happenings` that have come to an end nothing more is heard."""
        self._waiting.append(job)

    def happenings(self) -> Generator[JobUpdate, None, None]:
        """What happens, until there is nothing left to do; where its consumer closes it, everything is killed."""
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
        """The job to start now. A suspect has the warm process to itself."""
        suspected = self._tried & self._running.keys()
        if self._suspects and not self._running:
            return self._suspects.popleft()
        if self._suspects or suspected or not self._waiting or len(self._running) >= self._workers:
            return None
        return self._waiting.popleft()

    def _patience(self) -> float:
        """Preparing has the wall limit of the job, and nothing else is heard meanwhile."""
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
        """Answer the jobs that are to blame; the others run again."""
        under_way, prepared = list(self._running.values()), self._preparing
        self._running.clear()
        self._preparing = None
        # A SIGKILL comes from outside, perhaps from a neighbour; everything else it did by itself.
        culprit = prepared if silent or death.code != -signal.SIGKILL or len(under_way) == 1 else None
        how = f"did not answer and {death.how}" if silent else death.how
        if not self._alive:  # it cannot even start, and will not for any other
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


# MERGED: A warm process that waits for jobs which come one by one, for a caller who has other things to do in between.
class OnDemandRunner:
    """Runs jobs as a session does, each in a process of its own; what was imported and built stays for the next.

    `entry` is how Python is called to be the warm process. A context, which ends that process.
    """

    def __init__(self, entry: Sequence[str]) -> None:
        self._supervisor = Supervisor((), 1, entry, lambda: True)
        self._happenings: Generator[JobUpdate, None, None] | None = None

    def __enter__(self) -> "OnDemandRunner":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(self, job: Job) -> ProcessEnd | ForkServerDeath:
        """Run it; how its process ended. Whatever is raised meanwhile (Ctrl-C) ends the warm process, too."""
        self._supervisor.add(job)
        if self._happenings is None:
            self._happenings = self._supervisor.happenings()
        try:
            return next(one.end for one in self._happenings if isinstance(one, Ended) and one.job is job)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the warm process, if there is one."""
        if self._happenings is not None:
            self._happenings.close()
            self._happenings = None
