"""Backends execute the jobs of a session, on this machine or on others."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from simscen.run.process.jobs import ForkServerDeath, Job, ProcessEnd
from simscen.spec.registry import Entry


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


JobUpdate = Started | Progressed | Ended


def always() -> bool:
    """Return True."""
    return True


class Backend(Protocol):
    """Executes jobs in processes, which it keeps between two calls of `run`. Leaving its context ends them."""

    def __enter__(self) -> "Backend": ...

    def __exit__(self, *_: object) -> None: ...

    def run(
        self, jobs: Iterable[Job], plugins: Sequence[Entry] = (), should_continue: Callable[[], bool] = always
    ) -> Iterator[JobUpdate]:
        """Execute jobs, several at a time, and yield their updates: exactly one Ended for each that was started.

        `plugins` are those that the jobs use. `should_continue` is called before each job; no job starts once it
        returns False. If the consumer stops early or an exception passes through, all running processes are killed.
        """
        ...
