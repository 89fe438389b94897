"""Writer of MCAP files that is fast enough for every simulation step.

This module encodes messages, chunks, and indexes itself, because the mcap library is too slow for these records.
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

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of an MCAP file."""
MAX_CHUNK_BYTES = 1 << 18
"""Size above which a chunk is written at once."""
CHUNK_FLUSH_BYTES = 1 << 16
"""Size from which `McapWriter.flush_if_due` writes a chunk."""
CHUNK_FLUSH_NS = 500_000_000
"""Time span of messages from which `McapWriter.flush_if_due` writes a chunk."""
MESSAGE_HEADER_BYTES = 31
"""Size of a Message record without the message."""
_MESSAGE = int(Opcode.MESSAGE)
_pack_message_header = struct.Struct("<BQHIQQ").pack_into
"""Packs the header of a Message record: opcode, record length, channel, sequence number, log time, publish time."""
_CHUNK_HEADER = struct.Struct("<BQ3QII4sQ")
"""Chunk record without the compressed records."""
_COMPRESSION_LEVEL = -2  # of zstd: 4 % larger files than level 1, but 25 % faster


class Chunk:
    """Buffer of the records of one MCAP chunk, which are compressed together. It is reused for the next chunk.

    Attributes:
        max_size: Number of bytes above which a Channel calls `on_full`.
        on_full: Function that must write and clear the chunk.
        size: Number of bytes of all records.
        view: The records, and free space after them.
        channels: All channels of the file, in the order of their IDs.
    """

    def __init__(self, max_size: int, on_full: Callable[[], None]) -> None:
        self.max_size, self.on_full = max_size, on_full
        self.size = 0
        self.view = memoryview(bytearray(2 * max_size))
        self.channels: list[Channel] = []

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

    def has_messages(self) -> bool:
        """Return whether the chunk has messages."""
        return bool(self.active_channels())

    def active_channels(self) -> "list[Channel]":
        """Return the channels with messages in the chunk."""
        return [channel for channel in self.channels if channel.entries]

    def content(self) -> memoryview:
        """Return all records."""
        return self.view[: self.size]

    def time_span(self) -> tuple[int, int]:
        """Return the times of the first and the last message in ns. The chunk must have messages."""
        channels = self.active_channels()
        return min([channel.entries[0] for channel in channels]), max([channel.entries[-2] for channel in channels])

    def clear(self) -> None:
        """Remove all records."""
        for channel in self.channels:
            channel.entries.clear()
        self.size = 0


class Channel:
    """Channel of one topic, which adds messages to a chunk.

    Attributes:
        id: ID of the channel in the file.
        chunk: Chunk that the channel adds messages to.
        entries: Two numbers for each message in the chunk: the time in ns, and the offset in the chunk in bytes.
    """

    def __init__(self, channel_id: int, chunk: Chunk) -> None:
        self.id, self.chunk = channel_id, chunk
        self.entries: list[int] = []
        chunk.channels.append(self)

    def write(self, time: int, data: bytes) -> None:
        """Add the serialized message `data` at `time` nanoseconds."""
        chunk, length = self.chunk, len(data)
        offset = chunk.size
        end = offset + MESSAGE_HEADER_BYTES + length
        if end > chunk.max_size:
            chunk.reserve(end)
        _pack_message_header(chunk.view, offset, _MESSAGE, 22 + length, self.id, 0, time, time)
        chunk.view[offset + MESSAGE_HEADER_BYTES : end] = data
        chunk.size = end
        self.entries += (time, offset)
        if end > chunk.max_size:
            chunk.on_full()

    def record_parts(self, message: Template) -> "list[bytes | Slot]":
        """Return the parts of a Message record for `compile_writer`: fixed bytes and slots of fields.

        The fields are `time` in ns, and the fields of `message`.
        """
        head = struct.pack("<BQHI", _MESSAGE, 22 + len(message.buffer), self.id, 0)
        return [head, Slot("Q", "time"), Slot("Q", "time"), *message.parts]

    def index_record(self) -> bytes:
        """Return the MessageIndex record with the messages of this channel in the chunk."""
        entries = self.entries
        size = 8 * len(entries)
        return struct.pack(f"<BQHI{len(entries)}Q", Opcode.MESSAGE_INDEX, 6 + size, self.id, size, *entries)


class Sink(Protocol):
    """Destination of the bytes of an MCAP file, such as an open file."""

    def write(self, data: bytes, /) -> object:
        """Write all of `data`."""
        ...


class McapWriter:
    """Writes an MCAP file to `sink`. Messages must be added in the order of their times.

    `profile` and `library` are fields of the MCAP header. A chunk is written when it exceeds `max_chunk_size` bytes.
    """

    def __init__(self, sink: Sink, profile: str, library: str, max_chunk_size: int = MAX_CHUNK_BYTES) -> None:
        self._sink = sink
        self._size = self._checksum = 0
        self._chunk = Chunk(max_chunk_size, self._write_chunk)
        self._compress = zstandard.ZstdCompressor(level=_COMPRESSION_LEVEL).compress
        self._schema_ids: dict[str, int] = {}
        self._schema_records: list[bytes] = []
        self._channel_records: list[bytes] = []
        self._topics: list[str] = []
        self._counts_by_channel: Counter[int] = Counter()
        self._chunk_indexes: list[bytes] = []
        self._chunk_times: list[int] = []
        self._attachment_indexes: list[records.AttachmentIndex] = []
        self._metadata_indexes: list[records.MetadataIndex] = []
        self._put(MAGIC)
        self._put(_encode(records.Header(profile, library)))

    def add_channel(self, topic: str, message_type: MessageType, metadata: Mapping[str, str]) -> Channel:
        """Add a channel of CDR messages for a topic, and return the channel."""
        schema_id = self._schema_ids.get(message_type.name)
        if schema_id is None:
            schema_id = self._schema_ids[message_type.name] = len(self._schema_ids) + 1
            definition = message_type.definition.encode()
            record = _encode(records.Schema(schema_id, definition, "ros2msg", message_type.name))
            self._schema_records.append(record)
            self._chunk.add_record(record)
        channel_id = len(self._channel_records) + 1
        record = _encode(records.Channel(channel_id, topic, "cdr", dict(metadata), schema_id))
        self._channel_records.append(record)
        self._topics.append(topic)
        self._chunk.add_record(record)
        return Channel(channel_id, self._chunk)

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Write an attachment."""
        attachment = _encode(records.Attachment(0, 0, name, media_type, data))
        index = records.AttachmentIndex(self._size, len(attachment), 0, 0, len(data), name, media_type)
        self._attachment_indexes.append(index)
        self._put(attachment)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        record = _encode(records.Metadata(name, dict(values)))
        self._metadata_indexes.append(records.MetadataIndex(self._size, len(record), name))
        self._put(record)

    def message_counts(self) -> dict[str, int]:
        """Return the number of added messages by topic, including messages that are not written yet."""
        pending = {channel.id: len(channel.entries) // 2 for channel in self._chunk.channels}
        return {
            topic: self._counts_by_channel[channel_id] + pending.get(channel_id, 0)
            for channel_id, topic in enumerate(self._topics, start=1)
        }

    def flush_if_due(self) -> None:
        """Write the current chunk if it has CHUNK_FLUSH_BYTES or spans CHUNK_FLUSH_NS."""
        if self._chunk.has_messages():
            start, end = self._chunk.time_span()
            if self._chunk.size >= CHUNK_FLUSH_BYTES or end - start >= CHUNK_FLUSH_NS:
                self._write_chunk()

    def finish(self) -> None:
        """Write the last chunk and the summary section with the index. Does not close the sink."""
        if self._chunk.has_messages():
            self._write_chunk()
        self._put(_encode(records.DataEnd(self._checksum)))
        start = self._size
        groups = self._summary_groups()
        offsets = []
        for group in groups:
            if group:
                offsets.append(_encode(records.SummaryOffset(group[0], self._size, len(group))))
                self._put(group)
        offset_start = self._size
        self._put(b"".join(offsets))
        # The checksum of the summary covers the footer up to the checksum itself.
        footer_head = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start)
        checksum = zlib.crc32(b"".join((*groups, *offsets, footer_head)))
        self._put(_encode(records.Footer(start, offset_start, checksum)))
        self._put(MAGIC)

    def _summary_groups(self) -> list[bytes]:
        """Return the records of the summary section, one group per type of record."""
        statistics = records.Statistics(
            attachment_count=len(self._attachment_indexes),
            channel_count=len(self._channel_records),
            channel_message_counts=dict(sorted(self._counts_by_channel.items())),
            chunk_count=len(self._chunk_indexes),
            message_count=self._counts_by_channel.total(),
            message_end_time=max(self._chunk_times, default=0),
            message_start_time=min(self._chunk_times, default=0),
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schema_records),
        )
        return [
            b"".join(self._schema_records),
            b"".join(self._channel_records),
            _encode(statistics),
            b"".join(self._chunk_indexes),
            _encode(*self._attachment_indexes),
            _encode(*self._metadata_indexes),
        ]

    def _write_chunk(self) -> None:
        """Write the current chunk and the message index of each channel after it, and clear the chunk."""
        chunk, chunk_start = self._chunk, self._size
        content, channels, (start, end) = chunk.content(), chunk.active_channels(), chunk.time_span()
        compressed, size = self._compress(content), len(content)
        head = _CHUNK_HEADER.pack(
            Opcode.CHUNK, 44 + len(compressed), start, end, size, zlib.crc32(content), 4, b"zstd", len(compressed)
        )
        parts, index_offsets = [head, compressed], list[int]()
        chunk_length = total_length = len(head) + len(compressed)
        for channel in channels:
            index = channel.index_record()
            parts.append(index)
            index_offsets += (channel.id, chunk_start + total_length)
            total_length += len(index)
            self._counts_by_channel[channel.id] += len(channel.entries) // 2
        index_length = total_length - chunk_length
        self._chunk_indexes.append(
            struct.pack(
                f"<BQ4QI{'HQ' * len(channels)}QI4s2Q",
                *(Opcode.CHUNK_INDEX, 68 + 5 * len(index_offsets), start, end, chunk_start, chunk_length),
                *(5 * len(index_offsets), *index_offsets, index_length, 4, b"zstd", len(compressed), size),
            )
        )
        self._chunk_times += (start, end)
        chunk.clear()
        self._put(b"".join(parts))

    def _put(self, data: bytes) -> None:
        self._sink.write(data)
        self._size += len(data)
        self._checksum = zlib.crc32(data, self._checksum)


def _encode(*items: records.McapRecord) -> bytes:
    """Return the bytes of MCAP records, one after the other."""
    builder = RecordBuilder()
    for item in items:
        item.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
