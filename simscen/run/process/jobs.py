"""Jobs (runs to execute), the interface of the backends that execute jobs, and the updates that backends report."""

import json
import os
import pickle
import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from simscen.core.records.run_result import RunKey
from simscen.loading.loaded import LoadedScenario
from simscen.run.kept_files import OutcomeFilter
from simscen.spec.registry import RegisteredType

_LENGTH = struct.Struct("<I")
"""Length in bytes of a pickled message, which precedes the message in a pipe."""


@dataclass(frozen=True)
class Job:
    """One run to execute.

    Attributes:
        number: Number of the job in the session.
        key: Scenario name, seed, variation, and stack, which identify the run.
        folder: Output folder of the run.
        wall_limit: Limit of the wall time in s.
        replay: Outcomes for which a replay page is written.
        picture: Outcomes for which a picture is written.
    """

    number: int
    scenario: LoadedScenario
    key: RunKey
    folder: Path
    wall_limit: float
    replay: OutcomeFilter = OutcomeFilter.NONE
    picture: OutcomeFilter = OutcomeFilter.ALL


@dataclass(frozen=True)
class ProcessEnd:
    """End of a worker process.

    Attributes:
        code: Exit code; None if a signal ended the process.
        signal: Number of the signal that ended the process, or None.
        killed_for: "timeout" if the process was killed at its limit of wall time, else None.
        final_message: End record that the worker sent (see worker.ExecuteJob), or None.
        wall: Wall time in s.
        cpu: Processor time in s.
        peak_bytes: Peak memory.
        left_processes: Whether child processes of the worker were still running, and were killed.
        output: Last part of the worker's output.
    """

    code: int | None
    signal: int | None
    killed_for: str | None
    final_message: dict[str, Any] | None
    wall: float
    cpu: float
    peak_bytes: int
    left_processes: bool
    output: str


@dataclass(frozen=True)
class ForkServerDeath:
    """End of a job because the fork server died or, on a Ray cluster, because the node was lost.

    Attributes:
        description: How the fork server ended.
        was_preparing: Whether the fork server was preparing this job.
        timed_out: Whether the fork server was killed because it did not respond while it prepared this job.
        output: Last part of the fork server's output.
        has_started: Whether the fork server had started, so that it sent a message.
    """

    description: str
    was_preparing: bool
    timed_out: bool
    output: str
    has_started: bool = True


def pack_message(message: Job | str) -> bytes:
    """Return a job, or the plug-in path that precedes the first job, as bytes for `receive_message`."""
    data = pickle.dumps(message)
    return _LENGTH.pack(len(data)) + data


def receive_message(pipe: int) -> Job | str | None:
    """Read one message from a pipe; return None at the end of the pipe."""
    head = _read_exactly(pipe, _LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    data = _read_exactly(pipe, length)
    if len(data) < length:
        return None
    message = pickle.loads(data)
    assert isinstance(message, Job | str)
    return message


def _read_exactly(pipe: int, size: int) -> bytes:
    data = bytearray()
    while len(data) < size and (piece := os.read(pipe, size - len(data))):
        data += piece
    return bytes(data)


def json_line(message: dict[str, Any]) -> bytes:
    """Return a message as one line of JSON."""
    return json.dumps(message, separators=(",", ":")).encode() + b"\n"


@dataclass(frozen=True)
class Started:
    """A job has started."""

    number: int


@dataclass(frozen=True)
class Progressed:
    """A job has simulated `seconds` of its run."""

    number: int
    seconds: float


@dataclass(frozen=True)
class Ended:
    """The worker process of a job has ended, or the fork server has died."""

    number: int
    end: ProcessEnd | ForkServerDeath


JobUpdate = Started | Progressed | Ended
"""Update on the job with the number `number`."""


class Backend(Protocol):
    """Executes jobs in worker processes. Leaving its context ends all processes."""

    def __enter__(self) -> "Backend": ...

    def __exit__(self, *_: object) -> None: ...

    def run(
        self,
        jobs: Iterable[Job],
        plugins: Sequence[RegisteredType] = (),
        should_continue: Callable[[], bool] = lambda: True,
    ) -> Iterator[JobUpdate]:
        """Execute jobs, several at a time, and yield their updates: exactly one Ended for each started job.

        `plugins` are the plug-ins that the jobs use. No job starts after `should_continue` has returned False. If the
        caller stops iterating or an exception is raised, all running processes are killed.
        """
        ...
