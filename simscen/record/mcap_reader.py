"""Reading of MCAP files: all records, or only the attached result."""

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

from simscen.record.log_header import RESULT_FILE
from simscen.record.mcap_writer import MAGIC

MAX_RECORD_BYTES = 1 << 28
"""Maximum size of a record or decompressed chunk."""


def open_log(path: Path) -> IO[bytes]:
    """Open a regular file for reading. Raises OSError for other files, such as a FIFO."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    return os.fdopen(descriptor, "rb")


def is_mcap(stream: IO[bytes]) -> bool:
    """Return whether a file begins with the MCAP magic bytes. The stream must be at its start, and stays there."""
    magic = stream.read(len(MAGIC))
    stream.seek(0)
    return magic == MAGIC


def attached_result(path: Path) -> dict[str, Any] | None:
    """Return the result.json that is attached to a log; None if it is missing or cannot be read."""
    try:
        with open_log(path) as stream:
            attachments = make_reader(stream).iter_attachments()
            found = next((file for file in attachments if file.name == RESULT_FILE), None)
            data = json.loads(found.data) if found is not None else None
    except (OSError, McapError, ValueError, struct.error):
        return None
    return data if isinstance(data, dict) else None


class RecordReader:
    """Iterates over all records of an MCAP file, including records inside chunks.

    The iteration ends before a truncated record, and sets `is_truncated` to True. The iteration raises exceptions of
    the mcap library for bytes that are not MCAP, and ValueError for a chunk above MAX_RECORD_BYTES.
    """

    def __init__(self, stream: IO[bytes]) -> None:
        # The library does not detect a truncated record. StreamReader accepts any object with a `read` method.
        source: Any = _ExactStream(stream)
        self._reader = StreamReader(source, emit_chunks=True, validate_crcs=True, record_size_limit=MAX_RECORD_BYTES)
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
    """Return an lz4 chunk without compression, and any other chunk unchanged.

    Raises ValueError if the chunk is damaged or has more than MAX_RECORD_BYTES.
    """
    if chunk.uncompressed_size > MAX_RECORD_BYTES:
        raise ValueError(f"a chunk has more than {MAX_RECORD_BYTES >> 20} MiB of messages")
    if chunk.compression != "lz4":
        return chunk
    try:  # the mcap library would decompress lz4 without a size limit
        data = LZ4FrameDecompressor().decompress(chunk.data, max_length=chunk.uncompressed_size + 1)
    except RuntimeError as error:
        raise ValueError(f"a chunk cannot be decompressed: {error}") from error
    if len(data) != chunk.uncompressed_size:
        raise ValueError("a chunk does not have the size that its header states")
    return replace(chunk, compression="", data=data)


class _ExactStream:
    """Stream that returns exactly the requested number of bytes, or raises EndOfFile."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream

    def read(self, size: int) -> bytes:
        data = self._stream.read(size)
        if len(data) < size:
            raise EndOfFile
        return data
