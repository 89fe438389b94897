"""Writes MCAP (https://mcap.dev/spec): chunked, compressed, indexed; the same calls give the same bytes.

The records are the mcap library's. Only the way of a message into its chunk is ours: the library's takes 3–4 µs a
message and fixes zstd's level at 3, which together is twice the time of all else in recording.
"""

import itertools
import struct
import zlib
from collections import Counter
from collections.abc import Mapping
from typing import Protocol

import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from simscen.record.chunk import Channel, Chunk
from simscen.record.schemas import MessageType

MAGIC = b"\x89MCAP0\r\n"
CHUNK_SIZE = 1 << 16  # what a SIGKILL can lose; 1 MiB, the library's default, would lose most runs whole
_COMPRESSION_LEVEL = 1  # as small as level 3 on particles and scans, four times as fast


class Sink(Protocol):
    """Where the bytes go."""

    def write(self, data: bytes, /) -> object:
        """Take all of `data`."""
        ...


class McapWriter:
    """An MCAP file in the making. Messages must come in the order of their time.

    A chunk leaves as soon as it is full; `finish` writes the rest and the index. Nothing is buffered beside the chunk
    in the making.
    """

    def __init__(self, sink: Sink, profile: str, library: str, chunk_size: int = CHUNK_SIZE) -> None:
        self._sink = sink
        self._written = self._checksum = 0
        self._chunk = Chunk(chunk_size, self._finish_chunk)
        self._compress = zstandard.ZstdCompressor(level=_COMPRESSION_LEVEL).compress
        self._schemas: dict[str, int] = {}
        self._schema_records: list[bytes] = []
        self._channel_records: list[bytes] = []
        self._counts: Counter[int] = Counter()
        self._chunks: list[records.ChunkIndex] = []
        self._attachments: list[records.AttachmentIndex] = []
        self._notes: list[records.MetadataIndex] = []
        self._put(MAGIC)
        self._put(_encoded(records.Header(profile, library)))

    def channel(self, topic: str, kind: MessageType, metadata: Mapping[str, str]) -> Channel:
        """Open a channel of CDR messages."""
        schema = self._schemas.get(kind.name)
        if schema is None:
            schema = self._schemas[kind.name] = len(self._schemas) + 1
            record = _encoded(records.Schema(schema, kind.definition.encode(), "ros2msg", kind.name))
            self._schema_records.append(record)
            self._chunk.put(record)
        number = len(self._channel_records) + 1
        record = _encoded(records.Channel(number, topic, "cdr", dict(metadata), schema))
        self._channel_records.append(record)
        self._chunk.put(record)
        return Channel(number, self._chunk)

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add a file."""
        attachment = _encoded(records.Attachment(0, 0, name, media_type, data))
        index = records.AttachmentIndex(self._written, len(attachment), 0, 0, len(data), name, media_type)
        self._attachments.append(index)
        self._put(attachment)

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record."""
        note = _encoded(records.Metadata(name, dict(values)))
        self._notes.append(records.MetadataIndex(self._written, len(note), name))
        self._put(note)

    def finish(self) -> None:
        """Write what is left and the summary; the sink stays open."""
        if self._chunk:
            self._finish_chunk()
        self._put(_encoded(records.DataEnd(self._checksum)))
        start = self._written
        groups = self._summary()
        offsets = []
        for group in groups:
            if group:
                offsets.append(_encoded(records.SummaryOffset(group[0], self._written, len(group))))
                self._put(group)
        offset_start = self._written
        self._put(b"".join(offsets))
        # The summary's checksum covers the footer up to the checksum itself.
        head = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start)
        checksum = zlib.crc32(b"".join((*groups, *offsets, head)))
        self._put(_encoded(records.Footer(start, offset_start, checksum)))
        self._put(MAGIC)

    def _summary(self) -> list[bytes]:
        """Its groups of records."""
        statistics = records.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channel_records),
            channel_message_counts=dict(sorted(self._counts.items())),
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_end_time=max((c.message_end_time for c in self._chunks), default=0),
            message_start_time=min((c.message_start_time for c in self._chunks), default=0),
            metadata_count=len(self._notes),
            schema_count=len(self._schema_records),
        )
        told = b"".join(self._schema_records), b"".join(self._channel_records), _encoded(statistics)
        return [*told, _encoded(*self._chunks), _encoded(*self._attachments), _encoded(*self._notes)]

    def _finish_chunk(self) -> None:
        content, (start, end) = self._chunk.content(), self._chunk.span()
        packed = self._compress(content)
        record = _encoded(records.Chunk("zstd", packed, end, start, zlib.crc32(content), len(content)))
        at, index = self._written, {channel.number: channel.index() for channel in self._chunk.spoken}
        places = itertools.accumulate(map(len, index.values()), initial=at + len(record))
        self._chunks.append(
            records.ChunkIndex(
                chunk_length=len(record),
                chunk_start_offset=at,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=end,
                message_index_length=sum(map(len, index.values())),
                message_index_offsets=dict(zip(index, places, strict=False)),
                message_start_time=start,
                uncompressed_size=len(content),
            )
        )
        self._counts.update({channel.number: channel.count for channel in self._chunk.spoken})
        self._chunk.clear()
        self._put(b"".join((record, *index.values())))

    def _put(self, data: bytes) -> None:
        self._sink.write(data)
        self._written += len(data)
        self._checksum = zlib.crc32(data, self._checksum)


def _encoded(*items: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    for item in items:
        item.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
