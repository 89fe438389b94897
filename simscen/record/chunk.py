"""A chunk of an MCAP file in the making."""

import struct

from mcap.opcode import Opcode

_MESSAGE = int(Opcode.MESSAGE)
_pack_head = struct.Struct("<BQHIQQ").pack


class Chunk:
    """Records that will be compressed together, in the order they came."""

    def __init__(self) -> None:
        self.size = 0
        self._parts: list[bytes] = []
        self._index: dict[int, list[int]] = {}  # channel → time, offset, time, offset …

    def put(self, record: bytes) -> None:
        """Add a schema or a channel."""
        self._parts.append(record)
        self.size += len(record)

    def message(self, channel: int, time: int, data: bytes) -> None:
        """Add a message at `time` nanoseconds."""
        entries = self._index.get(channel)
        if entries is None:
            entries = self._index[channel] = []
        entries += (time, self.size)
        self._parts += (_pack_head(_MESSAGE, 22 + len(data), channel, 0, time, time), data)
        self.size += 31 + len(data)

    def __bool__(self) -> bool:
        """Whether it holds messages; a chunk without any says nothing that the summary does not."""
        return bool(self._index)

    def content(self) -> bytes:
        """All records."""
        return b"".join(self._parts)

    def span(self) -> tuple[int, int]:
        """The times of the first and the last message; messages come in the order of their time."""
        lists = self._index.values()
        return min(entries[0] for entries in lists), max(entries[-2] for entries in lists)

    def counts(self) -> dict[int, int]:
        """The number of messages of each channel."""
        return {channel: len(entries) // 2 for channel, entries in self._index.items()}

    def indices(self) -> dict[int, bytes]:
        """A MessageIndex record for each channel."""
        return {channel: _message_index(channel, entries) for channel, entries in self._index.items()}


def _message_index(channel: int, entries: list[int]) -> bytes:
    size = 8 * len(entries)
    return struct.pack(f"<BQHI{len(entries)}Q", Opcode.MESSAGE_INDEX, 6 + size, channel, size, *entries)
