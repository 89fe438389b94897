"""A chunk of an MCAP file in the making, and the channels that write into it."""

import struct
from collections.abc import Callable

from mcap.opcode import Opcode

from simscen.record.cdr import Slot, Template

HEAD = 31
"""Bytes of a record before its message."""
_MESSAGE = int(Opcode.MESSAGE)
_pack_head = struct.Struct("<BQHIQQ").pack


class Chunk:
    """Records that will be compressed together, in the order they came. `full` is called when it has reached `limit`
    bytes, and empties it.
    """

    def __init__(self, limit: int, full: Callable[[], None]) -> None:
        self.limit, self.full = limit, full
        self.size = 0
        self.parts: list[bytes] = []
        self.spoken: list[Channel] = []
        """The channels that have a message in it, in the order of their first."""

    def put(self, record: bytes) -> None:
        """Add a schema or a channel."""
        self.parts.append(record)
        self.size += len(record)

    def __bool__(self) -> bool:
        """Whether it holds messages; a chunk without any says nothing that the summary does not."""
        return bool(self.spoken)

    def content(self) -> bytes:
        """All records."""
        return b"".join(self.parts)

    def span(self) -> tuple[int, int]:
        """The times of the first and the last message; messages come in the order of their time."""
        return min(channel.entries[0] for channel in self.spoken), max(channel.entries[-2] for channel in self.spoken)

    def clear(self) -> None:
        """Begin the next one."""
        for channel in self.spoken:
            channel.entries.clear()
        self.size, self.parts, self.spoken = 0, [], []


class Channel:
    """Messages of one topic; `entries` are the times of those in the chunk, each followed by its offset there."""

    def __init__(self, number: int, chunk: Chunk) -> None:
        self.number, self.chunk = number, chunk
        self.entries: list[int] = []

    def write(self, time: int, data: bytes) -> None:
        """Add a message at `time` nanoseconds."""
        chunk, length = self.chunk, len(data)
        if not self.entries:
            chunk.spoken.append(self)
        self.entries += (time, chunk.size)
        chunk.parts += (_pack_head(_MESSAGE, 22 + length, self.number, 0, time, time), data)
        chunk.size += HEAD + length
        if chunk.size > chunk.limit:
            chunk.full()

    def record(self, message: Template) -> "list[bytes | Slot]":
        """A message of fixed size as a record of the chunk; its field `time` comes first."""
        head = struct.pack("<BQHI", _MESSAGE, 22 + len(message.buffer), self.number, 0)
        return [head, Slot("Q", "time"), Slot("Q", "time"), *message.parts]

    @property
    def count(self) -> int:
        """How many messages of it are in the chunk."""
        return len(self.entries) // 2

    def index(self) -> bytes:
        """The MessageIndex record of the chunk for this channel."""
        size = 8 * len(self.entries)
        head = Opcode.MESSAGE_INDEX, 6 + size, self.number, size
        return struct.pack(f"<BQHI{len(self.entries)}Q", *head, *self.entries)
