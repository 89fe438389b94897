"""Writer of MCAP files that is fast enough for every simulation step.

It encodes messages, chunks, and their indexes itself, because the mcap library is too slow for these records.
"""

import struct
import zlib
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Protocol

import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from simscen.record.messages.template import Slot, Template
from simscen.record.topics import MessageType

MESSAGE_HEADER_BYTES = 31
"""Size of a Message record without the message."""
_MESSAGE = int(Opcode.MESSAGE)
_pack_head = struct.Struct("<BQHIQQ").pack_into
"""Packs the header of a Message record: opcode, record length, channel, sequence number, log time, publish time."""


class Chunk:
    """Buffer of the records of one MCAP chunk, which are compressed together.

    A Channel calls `on_full` when the buffer exceeds `limit` bytes. `on_full` must write and clear the chunk.
    """

    def __init__(self, limit: int, on_full: Callable[[], None]) -> None:
        self.limit, self.on_full = limit, on_full
        self.size = 0
        self.view = memoryview(bytearray(2 * limit))
        """The records, followed by free space."""
        self.channels: list[Channel] = []
        """All channels of the file, in the order of their numbers."""

    def add_record(self, record: bytes) -> None:
        """Add a schema or channel record."""
        end = self.size + len(record)
        self.reserve(end)
        self.view[self.size : end] = record
        self.size = end

    def reserve(self, end: int) -> None:
        """Enlarge the buffer to at least `end` bytes."""
        if end > len(self.view):
            larger = memoryview(bytearray(2 * end))
            larger[: self.size] = self.content()
            self.view = larger

    def __bool__(self) -> bool:
        """Return whether the chunk has messages."""
        return bool(self.active_channels())

    def active_channels(self) -> "list[Channel]":
        """Return the channels with messages in the chunk."""
        return [channel for channel in self.channels if channel.entries]

    def content(self) -> memoryview:
        """Return all records."""
        return self.view[: self.size]

    def time_span(self) -> tuple[int, int]:
        """Return the times of the first and the last message in ns."""
        active = self.active_channels()
        return min([channel.entries[0] for channel in active]), max([channel.entries[-2] for channel in active])

    def clear(self) -> None:
        """Remove all records."""
        for channel in self.channels:
            channel.entries.clear()
        self.size = 0


class Channel:
    """Channel of one topic, which adds messages to a chunk. `number` is the ID of the channel in the file.

    `entries` has two numbers for each message in the chunk: its time in ns, and its offset in the chunk.
    """

    def __init__(self, number: int, chunk: Chunk) -> None:
        self.number, self.chunk = number, chunk
        self.entries: list[int] = []
        chunk.channels.append(self)

    def write(self, time: int, data: bytes) -> None:
        """Add a message at `time` nanoseconds."""
        chunk, length = self.chunk, len(data)
        at = chunk.size
        end = at + MESSAGE_HEADER_BYTES + length
        if end > chunk.limit:
            chunk.reserve(end)
        _pack_head(chunk.view, at, _MESSAGE, 22 + length, self.number, 0, time, time)
        chunk.view[at + MESSAGE_HEADER_BYTES : end] = data
        chunk.size = end
        self.entries += (time, at)
        if end > chunk.limit:
            chunk.on_full()

    def record(self, message: Template) -> "list[bytes | Slot]":
        """Return the template of a Message record, from which `compile_writer` makes a function that writes the record.

        Its fields are `time` in ns, and the fields of `message`.
        """
        head = struct.pack("<BQHI", _MESSAGE, 22 + len(message.buffer), self.number, 0)
        return [head, Slot("Q", "time"), Slot("Q", "time"), *message.parts]

    def index(self) -> bytes:
        """Return the MessageIndex record with the messages of this channel in the chunk."""
        entries = self.entries
        size = 8 * len(entries)
        return struct.pack(f"<BQHI{len(entries)}Q", Opcode.MESSAGE_INDEX, 6 + size, self.number, size, *entries)


MAGIC = b"\x89MCAP0\r\n"
CHUNK_BYTES = 1 << 18
"""Size above which a chunk is always written."""
CHUNK_FLUSH_BYTES, CHUNK_FLUSH_NS = 1 << 16, 500_000_000
"""Size and time span from which `flush_if_due` writes a chunk."""
_CHUNK = struct.Struct("<BQ3QII4sQ")
"""Chunk record without its data."""
_COMPRESSION_LEVEL = -2  # of zstd: 4 % larger files than level 1, but 25 % faster


class Sink(Protocol):
    """Destination of the bytes of an MCAP file, such as an open file."""

    def write(self, data: bytes, /) -> object:
        """Write all of `data`."""
        ...


class McapWriter:
    """Writes an MCAP file to `sink`. Messages must be added in the order of their times.

    `profile` and `library` are fields of the MCAP header. A chunk is written when it exceeds `chunk_size` bytes.
    """

    def __init__(self, sink: Sink, profile: str, library: str, chunk_size: int = CHUNK_BYTES) -> None:
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
        self._metadata: list[records.MetadataIndex] = []
        self._put(MAGIC)
        self._put(_encode(records.Header(profile, library)))

    def channel(self, topic: str, kind: MessageType, metadata: Mapping[str, str]) -> Channel:
        """Add a channel of CDR messages for a topic, and return the channel."""
        schema = self._schemas.get(kind.name)
        if schema is None:
            schema = self._schemas[kind.name] = len(self._schemas) + 1
            record = _encode(records.Schema(schema, kind.definition.encode(), "ros2msg", kind.name))
            self._schema_records.append(record)
            self._chunk.add_record(record)
        number = len(self._channel_records) + 1
        record = _encode(records.Channel(number, topic, "cdr", dict(metadata), schema))
        self._channel_records.append(record)
        self._topics.append(topic)
        self._chunk.add_record(record)
        return Channel(number, self._chunk)

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Write an attachment."""
        attachment = _encode(records.Attachment(0, 0, name, media_type, data))
        index = records.AttachmentIndex(self._written, len(attachment), 0, 0, len(data), name, media_type)
        self._attachments.append(index)
        self._put(attachment)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        record = _encode(records.Metadata(name, dict(values)))
        self._metadata.append(records.MetadataIndex(self._written, len(record), name))
        self._put(record)

    def message_counts(self) -> dict[str, int]:
        """Return the number of added messages by topic."""
        pending = {channel.number: len(channel.entries) // 2 for channel in self._chunk.channels}
        return {
            topic: self._counts[number] + pending.get(number, 0) for number, topic in enumerate(self._topics, start=1)
        }

    def flush_if_due(self) -> None:
        """Write the current chunk if it has CHUNK_FLUSH_BYTES or spans CHUNK_FLUSH_NS."""
        if self._chunk:
            start, end = self._chunk.time_span()
            if self._chunk.size >= CHUNK_FLUSH_BYTES or end - start >= CHUNK_FLUSH_NS:
                self._finish_chunk()

    def finish(self) -> None:
        """Write the last chunk and the summary section with the index. Does not close the sink."""
        if self._chunk:
            self._finish_chunk()
        self._put(_encode(records.DataEnd(self._checksum)))
        start = self._written
        groups = self._summary()
        offsets = []
        for group in groups:
            if group:
                offsets.append(_encode(records.SummaryOffset(group[0], self._written, len(group))))
                self._put(group)
        offset_start = self._written
        self._put(b"".join(offsets))
        # The summary's checksum covers the footer up to the checksum itself.
        head = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start)
        checksum = zlib.crc32(b"".join((*groups, *offsets, head)))
        self._put(_encode(records.Footer(start, offset_start, checksum)))
        self._put(MAGIC)

    def _summary(self) -> list[bytes]:
        """Return the records of the summary section, one group per type of record."""
        statistics = records.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channel_records),
            channel_message_counts=dict(sorted(self._counts.items())),
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_end_time=max(self._times, default=0),
            message_start_time=min(self._times, default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schema_records),
        )
        schemas, channels = b"".join(self._schema_records), b"".join(self._channel_records)
        indices = b"".join(self._chunks), _encode(*self._attachments), _encode(*self._metadata)
        return [schemas, channels, _encode(statistics), *indices]

    def _finish_chunk(self) -> None:
        chunk, chunk_start = self._chunk, self._written
        content, channels, (start, end) = chunk.content(), chunk.active_channels(), chunk.time_span()
        packed, size = self._compress(content), len(content)
        head = _CHUNK.pack(
            Opcode.CHUNK, 44 + len(packed), start, end, size, zlib.crc32(content), 4, b"zstd", len(packed)
        )
        parts, index_offsets = [head, packed], list[int]()
        length = written = len(head) + len(packed)
        for channel in channels:
            index = channel.index()
            parts.append(index)
            index_offsets += (channel.number, chunk_start + written)
            written += len(index)
            self._counts[channel.number] += len(channel.entries) // 2
        self._chunks.append(
            struct.pack(
                f"<BQ4QI{'HQ' * len(channels)}QI4s2Q",
                *(Opcode.CHUNK_INDEX, 68 + 5 * len(index_offsets), start, end, chunk_start, length),
                *(5 * len(index_offsets), *index_offsets, written - length, 4, b"zstd", len(packed), size),
            )
        )
        self._times += (start, end)
        chunk.clear()
        self._put(b"".join(parts))

    def _put(self, data: bytes) -> None:
        self._sink.write(data)
        self._written += len(data)
        self._checksum = zlib.crc32(data, self._checksum)


def _encode(*items: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    for item in items:
        item.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
