"""Jobs of one session on a Ray cluster: which jobs are waiting, running, or must be repeated."""

import shutil
from collections import deque
from collections.abc import Callable, Iterable, Iterator

from simscen.run.process.jobs import Ended, ForkServerDeath, Job, JobUpdate, Progressed, Started
from simscen.run.process.ray_node import FileChunk, NodeUpdate

MAX_ATTEMPTS = 2
"""Maximum number of attempts at a job if its runner or node is lost."""


class JobBatch:
    """Jobs of one call of `RayBackend.run`, by number: `queued` are in the queue, and `running` are on a node."""

    def __init__(self, jobs: Iterable[Job], should_continue: Callable[[], bool]) -> None:
        self._jobs, self._should_continue = iter(jobs), should_continue
        self._retries = deque[Job]()
        self._attempts: dict[int, int] = {}
        self._next_job: Job | None = None
        self.queued: dict[int, Job] = {}
        self.running: dict[int, Job] = {}

    def next_job(self) -> Job | None:
        """Return the next job to send, or None if there is none."""
        if not self._should_continue():
            return None
        job, self._next_job = self._next_job, None
        if job is None:
            job = self._retries.popleft() if self._retries else next(self._jobs, None)
        return job

    def is_unfinished(self) -> bool:
        """Return whether any job is running or can still start."""
        if self.running:
            return True
        if not self._should_continue():
            return False
        if not self.queued and self._next_job is None:
            self._next_job = self.next_job()
        return bool(self.queued) or self._next_job is not None

    def process_update(self, update: NodeUpdate) -> Iterator[JobUpdate]:
        """Process an update from a node: write file chunks to the job's folder, and yield all other updates."""
        match update:
            case Started(number):
                if (job := self.queued.pop(number, None)) is not None:
                    self.running[number] = job
                    shutil.rmtree(job.folder, ignore_errors=True)
                    if number not in self._attempts:
                        yield update
            case Progressed():
                yield update
            case FileChunk(number, name, data):
                file = (self.running.get(number) or self.queued[number]).folder / name
                file.parent.mkdir(parents=True, exist_ok=True)
                with file.open("ab") as output:
                    output.write(data)
            case Ended(number):
                if self.running.pop(number, None) is None:
                    del self.queued[number]
                yield update

    def retry_or_fail(self, number: int, address: str) -> Iterator[JobUpdate]:
        """Queue a job of a lost runner again, or yield its end after MAX_ATTEMPTS."""
        job = self.running.pop(number, None) or self.queued.pop(number, None)
        if job is None:
            return
        self._attempts[number] = self._attempts.get(number, 1) + 1
        if self._attempts[number] <= MAX_ATTEMPTS:
            self._retries.append(job)
            return
        description = f"was lost with its node {address}, as before on another node"
        yield Ended(number, ForkServerDeath(description, False, False, ""))
