"""Fixtures that read messages like the log of a real robot. Makes the helper modules of this folder importable."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from foreign_logs import Message, write_mcap

from simscen.core.errors import InvalidInput
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.read import ForeignLog, read_foreign_log

MOCAP = ForeignLogOptions(truth="/mocap")


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., ForeignLog]:
    """Return a function that writes messages to an MCAP file and reads it."""

    def call(messages: list[Message], settings: ForeignLogOptions = MOCAP, **options: Any) -> ForeignLog:
        return read_foreign_log(write_mcap(tmp_path / "a.mcap", messages, **options), settings)

    return call


@pytest.fixture
def refused(read: Callable[..., ForeignLog]) -> Callable[..., str]:
    """Return a function that returns the reason why a log cannot be used."""

    def call(messages: list[Message], settings: ForeignLogOptions = MOCAP, **options: Any) -> str:
        with pytest.raises(InvalidInput) as raised:
            read(messages, settings, **options)
        (problem,) = raised.value.problems
        return f"{problem.code} {problem.message} ({problem.hint})"

    return call
