"""What the supervisor asks the warm process for, and what it hears back."""

import json
import pickle
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from simscen.core.result import RunKey
from simscen.loading.loaded import LoadedScenario

_LENGTH = struct.Struct("<I")


@dataclass(frozen=True)
class Job:
    """One run: a scenario that has been validated, a seed, and the folder its files go to."""

    number: int
    scenario: LoadedScenario
    key: RunKey
    folder: Path
    wall_limit: float


@dataclass(frozen=True)
class ProcessEnd:
    """How the process of a job ended. `last_word` is the worker's own, None when it had none."""

    number: int
    code: int | None
    signal: int | None
    killed_for: str | None
    last_word: dict[str, Any] | None
    wall: float
    cpu: float
    peak_bytes: int
    left_processes: bool


def send_job(stream: IO[bytes], job: Job) -> None:
    """Write one job; the other side is our own process, so pickle is safe."""
    data = pickle.dumps(job)
    stream.write(_LENGTH.pack(len(data)) + data)
    stream.flush()


def receive_job(stream: IO[bytes]) -> Job | None:
    """Read one job; None at the end of the stream."""
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    job = pickle.loads(stream.read(length))
    assert isinstance(job, Job)
    return job


def line(message: dict[str, Any]) -> bytes:
    """A message as one line of JSON."""
    return json.dumps(message, separators=(",", ":")).encode() + b"\n"
