"""The supervisor: hands jobs to the warm process, hears how they go, and loses none of them.

It never imports an engine, so that nothing an engine does can take it down. Every job it is given yields exactly one
answer: the worker's own last word counts only if its process also exited with status 0 and was not killed by us.
"""

import json
import os
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import IO, Any

from simscen.run.confine import environment
from simscen.run.jobs import Job, ProcessEnd, send_job


@dataclass(frozen=True)
class Started:
    """A job has begun."""

    job: Job


@dataclass(frozen=True)
class Advanced:
    """A job has got so far, in simulated seconds."""

    job: Job
    seconds: float


@dataclass(frozen=True)
class Ended:
    """A job's process has ended; `end` None = the warm process died under it."""

    job: Job
    end: ProcessEnd | None


class Interrupted(BaseException):
    """The user or the system asks to stop; `number` is the signal's."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


Happening = Started | Advanced | Ended


def supervise(
    jobs: Iterable[Job], workers: int, entry: Sequence[str], go_on: Callable[[], bool]
) -> Iterator[Happening]:
    """Run all jobs, `workers` at a time, yielding what happens as it happens.

    `entry` is how Python is called to be the warm process, e.g. `-m module`. `go_on` is asked before each new job.
    When the consumer stops early (or an exception passes through), everything that still runs is killed.
    """
    waiting, running = deque(jobs), dict[int, Job]()
    while waiting and go_on():
        with _warm_process(entry) as (send, hear):
            try:
                yield from _converse(waiting, running, workers, send, hear, go_on)
            except (BrokenPipeError, EOFError):
                for job in running.values():
                    yield Ended(job, None)
                running.clear()


def _converse(
    waiting: deque[Job],
    running: dict[int, Job],
    workers: int,
    send: IO[bytes],
    hear: IO[bytes],
    go_on: Callable[[], bool],
) -> Iterator[Happening]:
    while True:
        while waiting and len(running) < workers and go_on():
            job = waiting.popleft()
            running[job.number] = job
            send_job(send, job)
        if not running:
            return
        text = hear.readline()
        if not text:
            raise EOFError
        yield _understood(json.loads(text), running)


def _understood(message: dict[str, Any], running: dict[int, Job]) -> Happening:
    if "started" in message:
        return Started(running[message["started"]])
    if "seconds" in message:
        return Advanced(running[message["job"]], message["seconds"])
    number = message.pop("exit")
    return Ended(running.pop(number), ProcessEnd(number=number, **message))


@contextmanager
def _warm_process(entry: Sequence[str]) -> Iterator[tuple[IO[bytes], IO[bytes]]]:
    """Start it; at the end close its input, which makes it kill what is left, and wait for it."""
    replies_out, replies_in = os.pipe()
    process = subprocess.Popen(
        [sys.executable, "-I", *entry, str(replies_in)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        pass_fds=[replies_in],
        env=environment(),
        start_new_session=True,
    )
    os.close(replies_in)
    assert process.stdin is not None
    try:
        with os.fdopen(replies_out, "rb") as hear:
            yield process.stdin, hear
    finally:
        with suppress(BrokenPipeError):  # it is dead already; that is what we wanted
            process.stdin.close()
        try:
            process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
