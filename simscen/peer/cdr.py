"""Writer and reader of ROS 2 messages in CDR (Common Data Representation, XCDR version 1, OMG DDSI-RTPS 10.5).

A message is a header of four bytes, followed by the fields. Each field is aligned to its own width, counted from the
end of the header.
"""

from __future__ import annotations

import struct
import sys
from array import array
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Sequence

HEADER = b"\x00\x01\x00\x00"
"""Header of a message in little-endian byte order."""
_BYTE_ORDERS = {b"\x00\x00": ">", b"\x00\x01": "<"}
"""Byte order, as in `struct`, by the first two bytes of a message."""
_TOO_SHORT = "the message ends before its type does"
W = TypeVar("W", bound="Writer")


class Writer:
    """Serializes a little-endian message field by field, in the order of its definition.

    All methods except `done` append to `buffer`, and return the writer.
    """

    def __init__(self) -> None:
        self.buffer = bytearray(HEADER)
        self._alignment_offset = -len(HEADER)

    def put(self: W, codes: str, *values: Any) -> W:
        """Append numbers of the same width. `codes` is their format as in `struct`, e.g. "iI" or "7d"."""
        self.align(struct.calcsize("<" + codes[-1]))
        self.buffer += struct.pack("<" + codes, *values)
        return self

    def string(self: W, text: str) -> W:
        """Append a string: its length with the terminating NUL, then its UTF-8 bytes."""
        encoded = text.encode() + b"\0"
        self.put("I", len(encoded))
        self.buffer += encoded
        return self

    def numbers(self: W, code: str, values: Sequence[float]) -> W:
        """Append the length of a sequence, and its numbers. `code` is a type code of `array`, e.g. "f"."""
        numbers = array(code, values)
        if sys.byteorder == "big":
            numbers.byteswap()
        self.put("I", len(numbers))
        if numbers:
            self.align(numbers.itemsize)
            self.buffer += numbers.tobytes()
        return self

    def align(self: W, width: int) -> W:
        """Append padding up to a multiple of `width` bytes."""
        self.buffer += bytes(-(len(self.buffer) + self._alignment_offset) % width)
        return self

    def done(self) -> bytes:
        """Return the serialized message."""
        return bytes(self.buffer)


class Reader:
    """Reads a message field by field, in the order of its definition and in either byte order.

    `offset` is the number of bytes that have been read, and `byte_order` is "<" or ">", as in `struct`. Methods raise
    ValueError if the data are not CDR or too short.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) < len(HEADER) or data[:2] not in _BYTE_ORDERS:
            raise ValueError("a message is not plain CDR")
        self._data, self.byte_order, self.offset = data, _BYTE_ORDERS[data[:2]], len(HEADER)

    def take(self, codes: str) -> tuple[Any, ...]:
        """Return the next numbers, which have the same width. `codes` is their format as in `struct`, e.g. "7d"."""
        layout = struct.Struct(self.byte_order + codes)
        self._align(struct.calcsize("<" + codes[-1]))
        try:
            values = layout.unpack_from(self._data, self.offset)
        except struct.error:
            raise ValueError(_TOO_SHORT) from None
        self.offset += layout.size
        return values

    def count(self) -> int:
        """Return the length of the next sequence."""
        return int(self.take("I")[0])

    def string(self) -> str:
        """Return the next string, without its terminating NUL."""
        return self.blob(self.count())[:-1].decode()

    def blob(self, size: int) -> bytes:
        """Return the next `size` bytes."""
        start = self._skip(size)
        return self._data[start : self.offset]

    def numbers(self, code: str) -> array[Any]:
        """Return the next sequence of numbers. `code` is a type code of `array`, e.g. "f"."""
        values: array[Any] = array(code)
        if count := self.count():
            self._align(values.itemsize)
            values.frombytes(self.blob(count * values.itemsize))
        if (self.byte_order == ">") is not (sys.byteorder == "big"):
            values.byteswap()
        return values

    def _align(self, width: int) -> None:
        """Skip padding up to a multiple of `width` bytes."""
        self.offset += -(self.offset - len(HEADER)) % width

    def _skip(self, size: int) -> int:
        """Skip `size` bytes, and return the offset of the first one."""
        start, self.offset = self.offset, self.offset + size
        if self.offset > len(self._data):
            raise ValueError(_TOO_SHORT)
        return start
