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

from simscen.core.errors import RunError
from simscen.record.log_header import RESULT

MAX_RECORD_BYTES = 1 << 28


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


class RecordReader:
    """All records up to the footer, or to the one that is cut short, which `cut` then says; chunks are opened.

    Going through them raises what the mcap library raises on bytes that are no MCAP.
    """

    def __init__(self, stream: IO[bytes]) -> None:
        # The library cannot see a record that is cut short; StreamReader takes anything that can `read`.
        exact: Any = _ExactStream(stream)
        self._reader = StreamReader(exact, validate_crcs=True, record_size_limit=MAX_RECORD_BYTES)
        self.cut = False

    def __iter__(self) -> Iterator[records.McapRecord]:
        try:
            yield from self._reader.records
        except EndOfFile:
            self.cut = True


class _ExactStream:
    """A stream that gives as many bytes as it is asked for, or raises EndOfFile."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream

    def read(self, size: int) -> bytes:
        data = self._stream.read(size)
        if len(data) < size:
            raise EndOfFile
        return data


PARTIAL_SUFFIX = ".partial.mcap"


class LogFile:
    """Writes `run.partial.mcap` and renames it to `run.mcap` on `finish`.

    Nothing is buffered in the process: what was written survives its death. A full disk or the like is a
    RunError of kind "output"; `failed` then says that the file takes no more.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.failed = False
        self.partial = path.with_suffix(PARTIAL_SUFFIX)
        try:
            self._raw = self.partial.open("wb", buffering=0)
        except OSError as error:
            raise write_error(self.partial, error) from error

    def write(self, data: bytes, /) -> None:
        """Write all of `data`; a raw write may take only a part."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._raw.write(rest) :]
        except OSError as error:
            self._raw.close()
            self.failed = True
            raise write_error(self.partial, error) from error

    def finish(self) -> None:
        """The log is whole: give it its name."""
        try:
            self._raw.close()
            self.partial.replace(self.path)
        except OSError as error:
            raise write_error(self.partial, error) from error

    def abandon(self) -> None:
        """The run broke off: leave what there is under the partial name."""
        self._raw.close()


def write_error(path: Path, error: OSError) -> RunError:
    """What a log that cannot be written means for its run."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return RunError("output", f"no space left writing {path}")
    return RunError("output", f"cannot write {path}: {error.strerror}")
