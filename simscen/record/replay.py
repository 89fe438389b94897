"""Reads a log back into the Trace of its run, so that it can be judged without a simulator."""

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from mcap.exceptions import EndOfFile, McapError
from mcap.stream_reader import StreamReader
from zstandard import ZstdError

from simscen.core.errors import InvalidInput
from simscen.core.problems import Problem
from simscen.core.trace import Trace
from simscen.record.contents import Contents, Foreign
from simscen.record.header import LogHeader
from simscen.record.logfile import PARTIAL_SUFFIX
from simscen.record.writer import MAGIC

LARGEST_RECORD = 1 << 28

# What the libraries and our own readers raise on bytes that no Recorder wrote.
_DAMAGE = (
    McapError,
    ZstdError,
    struct.error,
    ValueError,
    TypeError,
    LookupError,
    ArithmeticError,
    MemoryError,
    RecursionError,
)


@dataclass(frozen=True, eq=False)
class Log:
    """A log that was read: how the run was ordered, what happened, and its result (JSON; "" while there is none).

    `complete` is False for the log of a run that broke off; its trace then ends with the last message.
    """

    about: LogHeader
    trace: Trace
    result: str
    complete: bool


def read_log(path: "str | Path", partial: bool | None = None) -> Log:
    """Read a log that a Recorder wrote.

    Its trace is the one that a TraceBuilder makes of the same moments, equal to the last bit. With `partial`, a log
    that ends too early is read as far as it goes; by default that is so for files named `*.partial.mcap`. Raises
    InvalidInput when the file cannot be read, is no MCAP, is none of simscen's, is damaged, or ends too early.
    """
    path = Path(path)
    forgiving = path.name.endswith(PARTIAL_SUFFIX) if partial is None else partial
    contents = Contents()
    try:
        with path.open("rb") as stream:
            whole = _read(stream, contents)
        about = contents.header()
        if not whole and not forgiving:
            hint = "to read what there is, name it *.partial.mcap"
            raise _invalid(path, "SC803", "the log ends too early: its run broke off", hint)
        return Log(about, contents.trace(), contents.result(), whole)
    except OSError as error:
        raise _invalid(path, "SC800", f"cannot read the log: {error.strerror}") from error
    except Foreign as error:
        raise _invalid(path, "SC801", f"not a log of simscen: {error}") from error
    except _DAMAGE as error:
        raise _invalid(path, "SC802", f"the log is damaged: {error or type(error).__name__}") from error


def _read(stream: IO[bytes], contents: Contents) -> bool:
    """Put all records into `contents`; False when they stop before the end of the run."""
    if stream.read(len(MAGIC)) != MAGIC:
        raise Foreign("it is not an MCAP file")
    stream.seek(0)
    # The library cannot see a record that is cut short; StreamReader takes anything that can `read`.
    reader = StreamReader(_Exact(stream), validate_crcs=True, record_size_limit=LARGEST_RECORD)  # type: ignore[arg-type]
    try:
        for record in reader.records:
            contents.take(record)
    except EndOfFile:
        return False
    return contents.end is not None


class _Exact:
    """A stream that gives as many bytes as it is asked for, or raises EndOfFile."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream

    def read(self, size: int) -> bytes:
        data = self._stream.read(size)
        if len(data) < size:
            raise EndOfFile
        return data


def _invalid(path: Path, code: str, message: str, hint: str = "") -> InvalidInput:
    return InvalidInput([Problem(str(path), 0, 0, code, message, hint)])
