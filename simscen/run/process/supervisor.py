"""Supervisor: sends jobs to the fork server, and reports their progress and exactly one end for each job.

The supervisor's process never imports PyBullet or OMPL, so that a crash in these libraries cannot end it.
"""

import json
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from typing import Any

from simscen.run.process.fork_server_process import ForkServerProcess, ProcessDeath, Unresponsive
from simscen.run.process.isolation import plugin_path
from simscen.run.process.jobs import (
    Ended,
    ForkServerDeath,
    Job,
    JobUpdate,
    ProcessEnd,
    Progressed,
    Started,
    pack_message,
)
from simscen.spec.registry import RegisteredType

MAX_SILENCE_S = 30.0
"""Wall time without a message after which the fork server counts as dead, except while it prepares a job."""


class Interrupted(BaseException):
    """Exception that a signal handler raises to end the session. `number` is the number of the signal."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


class Supervisor:
    """Runs jobs in worker processes of a fork server on this machine, `workers` at a time.

    If the fork server dies while it prepares a job, this job fails, and all other running jobs are repeated. If the
    fork server dies at another time, or is killed from outside (SIGKILL), any running job may be the cause: each of
    these jobs is repeated alone, and fails if the fork server dies again. If the fork server cannot start, all jobs
    fail.
    """

    def __init__(self, workers: int, entry: Sequence[str], unused_server: ForkServerProcess | None = None) -> None:
        """`entry` are the Python arguments that start a fork server, such as `-m module`.

        `unused_server` is a fork server that was started before. It runs the first jobs.
        """
        self._workers, self._entry, self._unused_server = workers, tuple(entry), unused_server
        self._plugins: frozenset[RegisteredType] = frozenset()
        self._server: ForkServerProcess | None = None
        self._jobs: Iterator[Job] = iter(())
        self._should_continue: Callable[[], bool] = lambda: True
        self._retries, self._suspects = deque[Job](), deque[Job]()
        """Jobs to repeat, and jobs to repeat alone because each of them may have killed the fork server."""
        self._running: dict[int, Job] = {}
        self._preparing: Job | None = None
        self._reported: set[int] = set()
        self._suspect_numbers: set[int] = set()
        self._responded = False

    def __enter__(self) -> "Supervisor":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(
        self,
        jobs: Iterable[Job],
        plugins: Sequence[RegisteredType] = (),
        should_continue: Callable[[], bool] = lambda: True,
    ) -> Iterator[JobUpdate]:
        """Run jobs and yield their updates (see `Backend.run`).

        Takes a job from `jobs` only when it can start, or to fail it because the fork server cannot start.
        """
        if not self._plugins.issuperset(plugins):
            self.close()
            self._plugins |= frozenset(plugins)
        self._jobs, self._should_continue = iter(jobs), should_continue
        self._reported, self._suspect_numbers = set(), set()
        self._retries.clear()
        self._suspects.clear()
        try:
            while (job := self._next_job()) is not None:
                if self._server is None:
                    self._responded = False
                    self._server = self._unused_server or ForkServerProcess(self._entry)
                    self._unused_server = None
                    if self._plugins:
                        self._server.send(pack_message(plugin_path(self._plugins)))
                yield from self._run_jobs(self._server, job)
        finally:
            if self._running:
                self.close()

    def close(self) -> None:
        """Kill all workers and end the fork server."""
        if self._server is not None:
            self._server.close()
        self._server, self._preparing = None, None
        for jobs in (self._running, self._retries, self._suspects):
            jobs.clear()

    def _run_jobs(self, server: ForkServerProcess, first: Job) -> Iterator[JobUpdate]:
        """Run the job `first` and all following jobs, until the fork server dies."""
        job: Job | None = first
        try:
            while True:
                while job is not None:
                    self._running[job.number] = job
                    server.send(pack_message(job))
                    job = self._next_job()
                if not self._running:
                    return
                # Preparing a job may take as long as the wall limit of the job.
                timeout = MAX_SILENCE_S + (self._preparing.wall_limit if self._preparing else 0.0)
                update = self._process_message(server.receive_line(timeout))
                if update is not None:
                    yield update
                job = self._next_job()
        except (EOFError, Unresponsive) as error:
            unresponsive = isinstance(error, Unresponsive)
            if unresponsive:
                server.abort()
            death = server.collect_death()
            self._server = None
            server.close()
        yield from self._after_death(death, unresponsive)

    def _next_job(self) -> Job | None:
        """Return the next job, or None if no job can start now."""
        if not self._should_continue():
            return None
        running_suspects = self._suspect_numbers & self._running.keys()
        if self._suspects and not self._running:
            return self._suspects.popleft()
        if self._suspects or running_suspects or len(self._running) >= self._workers:
            return None
        return self._retries.popleft() if self._retries else next(self._jobs, None)

    def _process_message(self, text: bytes) -> JobUpdate | None:
        """Process a message of the fork server; return the update of a job, if the message contains one."""
        message: dict[str, Any] = json.loads(text)
        match message:
            case {"started": number}:
                self._preparing = self._running[number]
                if number not in self._reported:
                    self._reported.add(number)
                    return Started(number)
            case {"prepared": _}:
                self._preparing = None
            case {"job": number, "seconds": seconds}:
                return Progressed(number, seconds)
            case {"exit": number, **fields}:
                del self._running[number]
                return Ended(number, ProcessEnd(**fields))
            case _:
                self._responded = True
        return None

    def _after_death(self, death: ProcessDeath, was_unresponsive: bool) -> Iterator[JobUpdate]:
        """Yield the end of each job that fails because the fork server died, and queue all other jobs again."""
        running, in_preparation = list(self._running.values()), self._preparing
        self._running.clear()
        self._preparing = None
        # A SIGKILL comes from outside, perhaps from another job; other exits are caused by the fork server itself.
        culprit = in_preparation if was_unresponsive or death.code != -signal.SIGKILL or len(running) == 1 else None
        description = f"did not respond and {death.description}" if was_unresponsive else death.description
        # If the fork server cannot start, all other jobs fail as well.
        others = () if self._responded else iter(self._next_job, None)
        for job in chain(running, others):
            if job is culprit or job.number in self._suspect_numbers or not self._responded:
                timed_out = was_unresponsive and job is culprit
                end = ForkServerDeath(description, job is in_preparation, timed_out, death.output, self._responded)
                yield Ended(job.number, end)
            elif culprit is not None:
                self._retries.appendleft(job)
            else:
                self._suspect_numbers.add(job.number)
                self._suspects.append(job)
