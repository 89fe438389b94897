"""The message definitions of ROS 2 Humble, so that neither ROS nor rosbags is needed to write a log."""

import json
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Mapping
from importlib.resources import files
from typing import NamedTuple, Protocol

import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from simscen.record.messages.cdr import Slot, Template


class MessageType(NamedTuple):
    """A message type's full name, its definition with those it contains (ros2msg), and its hash (REP 2016)."""

    name: str
    definition: str
    hash: str


def load() -> dict[str, MessageType]:
    """All types a log can hold, by name; schemas.json is generated from rosbags and checked for drift."""
    table = json.loads(files(__package__).joinpath("schemas.json").read_text("utf-8"))
    return {name: MessageType(name, entry["definition"], entry["hash"]) for name, entry in table.items()}


MESSAGE_HEADER_BYTES = 31
"""Bytes of a record before its message."""
_MESSAGE = int(Opcode.MESSAGE)
_pack_head = struct.Struct("<BQHIQQ").pack_into


class Chunk:
    """Records that will be compressed together, in the order they came, each written to where it stays.

    `full` is called when it has reached `limit` bytes, and empties it.
    """

    def __init__(self, limit: int, full: Callable[[], None]) -> None:
        self.limit, self.full = limit, full
        self.size = 0
        self.view = memoryview(bytearray(2 * limit))
        """Its records, and room behind them."""
        self.channels: list[Channel] = []
        """All that write into it, in the order of their numbers."""

    def put(self, record: bytes) -> None:
        """Add a schema or a channel."""
        end = self.size + len(record)
        self.reach(end)
        self.view[self.size : end] = record
        self.size = end

    def reach(self, end: int) -> None:
        """See to it that there is room up to `end`."""
        if end > len(self.view):
            larger = memoryview(bytearray(2 * end))
            larger[: self.size] = self.content()
            self.view = larger

    def __bool__(self) -> bool:
        """Whether it holds messages; a chunk without any says nothing that the summary does not."""
        return bool(self.spoken())

    def spoken(self) -> "list[Channel]":
        """The channels that have a message in it."""
        return [channel for channel in self.channels if channel.entries]

    def content(self) -> memoryview:
        """All records."""
        return self.view[: self.size]

    def span(self) -> tuple[int, int]:
        """The times of the first and the last message; messages come in the order of their time."""
        spoken = self.spoken()
        return min([channel.entries[0] for channel in spoken]), max([channel.entries[-2] for channel in spoken])

    def clear(self) -> None:
        """Begin the next one."""
        for channel in self.channels:
            channel.entries.clear()
        self.size = 0


class Channel:
    """Messages of one topic; `entries` are the times of those in the chunk, each followed by its offset there."""

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
            chunk.reach(end)
        _pack_head(chunk.view, at, _MESSAGE, 22 + length, self.number, 0, time, time)
        chunk.view[at + MESSAGE_HEADER_BYTES : end] = data
        chunk.size = end
        self.entries += (time, at)
        if end > chunk.limit:
            chunk.full()

    def record(self, message: Template) -> "list[bytes | Slot]":
        """A message of fixed size as a record of the chunk; its field `time` comes first."""
        head = struct.pack("<BQHI", _MESSAGE, 22 + len(message.buffer), self.number, 0)
        return [head, Slot("Q", "time"), Slot("Q", "time"), *message.parts]

    def index(self) -> bytes:
        """The MessageIndex record of the chunk for this channel."""
        entries = self.entries
        size = 8 * len(entries)
        return struct.pack(f"<BQHI{len(entries)}Q", Opcode.MESSAGE_INDEX, 6 + size, self.number, size, *entries)


# The records are those of the mcap library, except for messages and chunks: the library takes 3–4 µs per message and
# fixes the level of zstd at 3, which together takes twice the time of everything else in recording.
MAGIC = b"\x89MCAP0\r\n"
CHUNK_BYTES = 1 << 18
"""Bytes that are compressed at once at most; chunks a quarter of that take a tenth more time."""
CHUNK_FLUSH_BYTES, CHUNK_FLUSH_NS = 1 << 16, 500_000_000
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
        self._notes: list[records.MetadataIndex] = []
        self._put(MAGIC)
        self._put(_encode(records.Header(profile, library)))

    def channel(self, topic: str, kind: MessageType, metadata: Mapping[str, str]) -> Channel:
        """Open a channel of CDR messages."""
        schema = self._schemas.get(kind.name)
        if schema is None:
            schema = self._schemas[kind.name] = len(self._schemas) + 1
            record = _encode(records.Schema(schema, kind.definition.encode(), "ros2msg", kind.name))
            self._schema_records.append(record)
            self._chunk.put(record)
        number = len(self._channel_records) + 1
        record = _encode(records.Channel(number, topic, "cdr", dict(metadata), schema))
        self._channel_records.append(record)
        self._topics.append(topic)
        self._chunk.put(record)
        return Channel(number, self._chunk)

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add a file."""
        attachment = _encode(records.Attachment(0, 0, name, media_type, data))
        index = records.AttachmentIndex(self._written, len(attachment), 0, 0, len(data), name, media_type)
        self._attachments.append(index)
        self._put(attachment)

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record."""
        note = _encode(records.Metadata(name, dict(values)))
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
            if self._chunk.size >= CHUNK_FLUSH_BYTES or end - start >= CHUNK_FLUSH_NS:
                self._finish_chunk()

    def finish(self) -> None:
        """Write what is left and the summary; the sink stays open."""
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
        told = b"".join(self._schema_records), b"".join(self._channel_records), _encode(statistics)
        return [*told, b"".join(self._chunks), _encode(*self._attachments), _encode(*self._notes)]

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


def _encode(*items: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    for item in items:
        item.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
