"""Writes MCAP (https://mcap.dev/spec): chunked, compressed, indexed; the same calls give the same bytes.

The records are the mcap library's. Only those of messages and chunks are packed here: the library takes 3–4 µs a
message and fixes zstd's level at 3, which together is twice the time of all else in recording.
"""

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
CHUNK_SIZE = 1 << 18
"""Bytes that are compressed at once at most; chunks a quarter of that take a tenth more time."""
ENOUGH, LONG_ENOUGH = 1 << 16, 500_000_000
"""Bytes or nanoseconds that are worth a chunk: what is in one that has not left is lost when the process is killed."""
_CHUNK = struct.Struct("<BQ3QII4sQ")
"""A Chunk record before its data."""
_COMPRESSION_LEVEL = -2  # 4 % larger than level 1, in three quarters of its time, which is a quarter of level 3's


class Sink(Protocol):
    """Where the bytes go."""

    def write(self, data: bytes, /) -> object:
        """Take all of `data`."""
        ...


class McapWriter:
    """An MCAP file in the making. Messages must come in the order of their time.

    A chunk leaves as soon as it is full, or at `settle`; `finish` writes the rest and the index. Nothing is buffered
    beside the chunk in the making.
    """

    def __init__(self, sink: Sink, profile: str, library: str, chunk_size: int = CHUNK_SIZE) -> None:
        self._sink = sink
        self._written = self._checksum = 0
        self._chunk = Chunk(chunk_size, self._finish_chunk)
        self._compress = zstandard.ZstdCompressor(level=_COMPRESSION_LEVEL).compress
        self._schemas: dict[str, int] = {}
        self._schema_records: list[bytes] = []
        self._channel_records: list[bytes] = []
        self._topics: list[str] = []
        self._counts: Counter[int] = Counter()
        self._chunks: list[bytes] = []
        self._times: list[int] = []
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
        self._topics.append(topic)
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

    def message_counts(self) -> dict[str, int]:
        """Return the number of messages so far by topic."""
        pending = {channel.number: len(channel.entries) // 2 for channel in self._chunk.channels}
        return {
            topic: self._counts[number] + pending.get(number, 0) for number, topic in enumerate(self._topics, start=1)
        }

    def settle(self) -> None:
        """Nothing more comes for a while: let the chunk leave if it is worth one."""
        if self._chunk:
            start, end = self._chunk.span()
            if self._chunk.size >= ENOUGH or end - start >= LONG_ENOUGH:
                self._finish_chunk()

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
            message_end_time=max(self._times, default=0),
            message_start_time=min(self._times, default=0),
            metadata_count=len(self._notes),
            schema_count=len(self._schema_records),
        )
        told = b"".join(self._schema_records), b"".join(self._channel_records), _encoded(statistics)
        return [*told, b"".join(self._chunks), _encoded(*self._attachments), _encoded(*self._notes)]

    def _finish_chunk(self) -> None:
        chunk, at = self._chunk, self._written
        content, spoken, (start, end) = chunk.content(), chunk.spoken(), chunk.span()
        packed, size = self._compress(content), len(content)
        head = _CHUNK.pack(
            Opcode.CHUNK, 44 + len(packed), start, end, size, zlib.crc32(content), 4, b"zstd", len(packed)
        )
        parts, places = [head, packed], list[int]()
        length = past = len(head) + len(packed)
        for channel in spoken:
            index = channel.index()
            parts.append(index)
            places += (channel.number, at + past)
            past += len(index)
            self._counts[channel.number] += len(channel.entries) // 2
        self._chunks.append(
            struct.pack(
                f"<BQ4QI{'HQ' * len(spoken)}QI4s2Q",
                *(Opcode.CHUNK_INDEX, 68 + 5 * len(places), start, end, at, length),
                *(5 * len(places), *places, past - length, 4, b"zstd", len(packed), size),
            )
        )
        self._times += (start, end)
        chunk.clear()
        self._put(b"".join(parts))

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
