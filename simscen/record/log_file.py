"""Opening log files, reading their MCAP records, and writing a log under a partial name until it is complete."""

import errno
import json
import os
import stat
import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from lz4.frame import LZ4FrameDecompressor
from mcap import records
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader, breakup_chunk

from simscen.core.errors import RunError
from simscen.record.log_header import RESULT

MAX_RECORD_BYTES = 1 << 28
PARTIAL_SUFFIX = ".partial.mcap"


def open_log(path: Path) -> IO[bytes]:
    """Open a file for reading. Raises OSError, also if it is not a regular file: reading a FIFO would block."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    return os.fdopen(descriptor, "rb")


def attached_result(path: Path) -> dict[str, Any] | None:
    """Return the result.json that is attached to a log, or None if the log or the attachment does not exist."""
    try:
        with open_log(path) as stream:
            attachments = make_reader(stream).iter_attachments()
            found = next((file for file in attachments if file.name == RESULT), None)
            data = json.loads(found.data) if found is not None else None
    except (OSError, McapError, ValueError, struct.error):
        return None
    return data if isinstance(data, dict) else None


class RecordReader:
    """Iterates over all records of an MCAP file, including those inside chunks.

    Stops before a truncated record and then sets `is_truncated`. Raises the exceptions of the mcap library on bytes
    that are not MCAP, and ValueError if a chunk is too large.
    """

    def __init__(self, stream: IO[bytes]) -> None:
        # The library does not detect a truncated record. StreamReader accepts any object with a `read` method.
        exact: Any = _ExactStream(stream)
        self._reader = StreamReader(exact, emit_chunks=True, validate_crcs=True, record_size_limit=MAX_RECORD_BYTES)
        self.is_truncated = False

    def __iter__(self) -> Iterator[records.McapRecord]:
        try:
            for record in self._reader.records:
                if isinstance(record, records.Chunk):
                    yield from breakup_chunk(_decompressed(record), validate_crc=True)
                else:
                    yield record
        except EndOfFile:
            self.is_truncated = True


def _decompressed(chunk: records.Chunk) -> records.Chunk:
    """Return a chunk with its data decompressed. Raises ValueError if these are more than MAX_RECORD_BYTES."""
    if chunk.compression == "lz4":  # the library would decompress it without a limit
        data = LZ4FrameDecompressor().decompress(chunk.data, max_length=MAX_RECORD_BYTES + 1)
        chunk = replace(chunk, compression="", data=data, uncompressed_size=len(data))
    if chunk.uncompressed_size > MAX_RECORD_BYTES:
        raise ValueError(f"a chunk has more than {MAX_RECORD_BYTES >> 20} MiB of messages")
    return chunk


class _ExactStream:
    """A stream that returns exactly the requested number of bytes, or raises EndOfFile."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream

    def read(self, size: int) -> bytes:
        data = self._stream.read(size)
        if len(data) < size:
            raise EndOfFile
        return data


class LogFile:
    """Writes `run.partial.mcap` and renames it to `run.mcap` on `finish`.

    Nothing is buffered in the process, so written data survives if the process is killed. If the disk is full or the
    file cannot be written, raises RunError of kind "output" and sets `failed`.
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
        """Write all of `data`."""
        rest = memoryview(data)  # a raw write may write only a part
        try:
            while rest:
                rest = rest[self._raw.write(rest) :]
        except OSError as error:
            self._raw.close()
            self.failed = True
            raise write_error(self.partial, error) from error

    def finish(self) -> None:
        """Close the file and give it its final name."""
        try:
            self._raw.close()
            self.partial.replace(self.path)
        except OSError as error:
            raise write_error(self.partial, error) from error

    def abandon(self) -> None:
        """Close the file and keep its partial name, because the run was aborted."""
        self._raw.close()


def write_error(path: Path, error: OSError) -> RunError:
    """Return the RunError for a log that cannot be written."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return RunError("output", f"no space left writing {path}")
    return RunError("output", f"cannot write {path}: {error.strerror}")
