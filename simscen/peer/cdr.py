"""Common Data Representation as ROS 2 writes it (XCDR version 1, little endian), with nothing but the standard library.

Fields are aligned to their own width, counted from the end of the four bytes of the encapsulation header.
"""

from __future__ import annotations

import struct
import sys
from array import array
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

HEADER = b"\x00\x01\x00\x00"


class Writer:
    """Serializes a message field by field, in the order of its definition."""

    def __init__(self) -> None:
        self._data = bytearray(HEADER)

    def put(self, codes: str, *values: Any) -> Writer:
        """Append values of one width, e.g. "iI" or "7d"."""
        self._align(struct.calcsize("<" + codes[-1]))
        self._data += struct.pack("<" + codes, *values)
        return self

    def string(self, text: str) -> Writer:
        """Append a string: its length with the closing NUL, then its UTF-8 bytes."""
        encoded = text.encode() + b"\0"
        self.put("I", len(encoded))
        self._data += encoded
        return self

    def numbers(self, code: str, values: Sequence[float]) -> Writer:
        """Append a sequence: the number of elements, then the elements."""
        numbers = array(code, values)
        if sys.byteorder == "big":
            numbers.byteswap()
        self.put("I", len(numbers))
        if numbers:
            self._align(numbers.itemsize)
            self._data += numbers.tobytes()
        return self

    def done(self) -> bytes:
        """Return the message."""
        return bytes(self._data)

    def _align(self, width: int) -> None:
        self._data += bytes(-(len(self._data) - len(HEADER)) % width)


class Reader:
    """Reads a message field by field, in the order of its definition. Raises ValueError if the message is too short."""

    def __init__(self, data: bytes) -> None:
        if data[:2] != HEADER[:2]:
            raise ValueError("not plain CDR, little endian")
        self._data, self._offset = data, len(HEADER)

    def take(self, codes: str) -> tuple[Any, ...]:
        """Return the next values of one width, e.g. "7d"."""
        layout = struct.Struct("<" + codes)
        self._align(struct.calcsize("<" + codes[-1]))
        self._require(layout.size)
        values = layout.unpack_from(self._data, self._offset)
        self._offset += layout.size
        return values

    def string(self) -> str:
        """Return the next string, without its closing NUL."""
        (size,) = self.take("I")
        return self.blob(size)[:-1].decode()

    def blob(self, size: int) -> bytes:
        """Return the next bytes."""
        self._require(size)
        self._offset += size
        return self._data[self._offset - size : self._offset]

    def numbers(self, code: str) -> array[Any]:
        """Return the next sequence of numbers, e.g. of code "f"."""
        (count,) = self.take("I")
        values: array[Any] = array(code)
        if count:
            self._align(values.itemsize)
            values.frombytes(self.blob(count * values.itemsize))
        if sys.byteorder == "big":
            values.byteswap()
        return values

    def _align(self, width: int) -> None:
        self._offset += -(self._offset - len(HEADER)) % width

    def _require(self, size: int) -> None:
        if self._offset + size > len(self._data):
            raise ValueError("the message ends before its type does")
