"""What the supervisor asks the warm process for, and what it hears back."""

import json
import os
import pickle
import struct
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from simscen.core.records.run_result import Outcome, RunKey
from simscen.loading.loaded import LoadedScenario

_LENGTH = struct.Struct("<I")


class ReplayMode(str, Enum):
    """Which runs get a page that plays them."""

    NONE = "none"
    FAILED = "failed"
    ALL = "all"

    def wants(self, outcome: Outcome) -> bool:
        """Whether a run that came out so gets one."""
        return self is ReplayMode.ALL or (self is ReplayMode.FAILED and not outcome.good)


@dataclass(frozen=True)
class Job:
    """One run: a scenario that has been validated, a seed, the folder its files go to, and whether it gets a page."""

    number: int
    scenario: LoadedScenario
    key: RunKey
    folder: Path
    wall_limit: float
    replay: ReplayMode = ReplayMode.NONE


@dataclass(frozen=True)
class ProcessEnd:
    """How the process of a job ended. `last_word` is the worker's own, None when it had none.

    `printed` is the end of what it printed.
    """

    number: int
    code: int | None
    signal: int | None
    killed_for: str | None
    last_word: dict[str, Any] | None
    wall: float
    cpu: float
    peak_bytes: int
    left_processes: bool
    printed: str


@dataclass(frozen=True)
class ForkServerDeath:
    """The warm process died under a job, or was killed because it no longer answered.

    `how` says so in words; `at_fault` = it was preparing this very job; `printed` is the end of what it printed.
    """

    how: str
    at_fault: bool
    timed_out: bool
    printed: str


def pack_job(job: Job) -> bytes:
    """One job as bytes; the other side is our own process, so pickle is safe."""
    data = pickle.dumps(job)
    return _LENGTH.pack(len(data)) + data


def receive_job(pipe: int) -> Job | None:
    """Read one job; None at the end of the stream. Nothing beyond it is read, so that `select` sees the next one."""
    head = _exactly(pipe, _LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    data = _exactly(pipe, length)
    if len(data) < length:
        return None
    job = pickle.loads(data)
    assert isinstance(job, Job)
    return job


def _exactly(pipe: int, size: int) -> bytes:
    data = bytearray()
    while len(data) < size and (piece := os.read(pipe, size - len(data))):
        data += piece
    return bytes(data)


def json_line(message: dict[str, Any]) -> bytes:
    """A message as one line of JSON."""
    return json.dumps(message, separators=(",", ":")).encode() + b"\n"
