"""Opens a log that somebody else may have put there, and reads the records that are whole."""

import errno
import json
import os
import stat
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from mcap import records
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from simscen.record.header import RESULT

LARGEST_RECORD = 1 << 28


def open_log(path: Path) -> IO[bytes]:
    """The file, for reading. Raises OSError, also for what is not a regular file: a FIFO would be waited for."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    return os.fdopen(descriptor, "rb")


def attached_result(path: Path) -> dict[str, Any] | None:
    """Return the result.json in a log, from the index at its end; None if there is no such log."""
    try:
        with open_log(path) as stream:
            found = next((one for one in make_reader(stream).iter_attachments() if one.name == RESULT), None)
            data = json.loads(found.data) if found is not None else None
    except (OSError, McapError, ValueError, struct.error):
        return None
    return data if isinstance(data, dict) else None


class WholeRecords:
    """All records up to the footer, or to the one that is cut short, which `cut` then says; chunks are opened.

    Going through them raises what the mcap library raises on bytes that are no MCAP.
    """

    def __init__(self, stream: IO[bytes]) -> None:
        # The library cannot see a record that is cut short; StreamReader takes anything that can `read`.
        exact: Any = _Exact(stream)
        self._reader = StreamReader(exact, validate_crcs=True, record_size_limit=LARGEST_RECORD)
        self.cut = False

    def __iter__(self) -> Iterator[records.McapRecord]:
        try:
            yield from self._reader.records
        except EndOfFile:
            self.cut = True


class _Exact:
    """A stream that gives as many bytes as it is asked for, or raises EndOfFile."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream

    def read(self, size: int) -> bytes:
        data = self._stream.read(size)
        if len(data) < size:
            raise EndOfFile
        return data
