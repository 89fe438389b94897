"""A chunk of an MCAP file in the making, and the channels that write into it."""

import struct
from collections.abc import Callable

from mcap.opcode import Opcode

from simscen.record.cdr import Slot, Template

HEAD = 31
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
        end = at + HEAD + length
        if end > chunk.limit:
            chunk.reach(end)
        _pack_head(chunk.view, at, _MESSAGE, 22 + length, self.number, 0, time, time)
        chunk.view[at + HEAD : end] = data
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
