"""Common Data Representation as ROS 2 writes it: XCDR version 1, little endian (OMG DDSI-RTPS 10.5).

Building messages field by field costs ten times what writing them does, so a message type is laid out once, as a
Template, and only what moves is filled in for each message.
"""

import math
import struct
from collections.abc import Callable
from functools import partial

import numpy as np
import numpy.typing as npt

HEADER = b"\x00\x01\x00\x00"


class Template:
    """A message of fixed size: constants are in place, slots are filled in for each message.

    Fields are appended in the order of the message definition and aligned to their own width, counted from `start`
    bytes before the first field. `prefix` is what precedes the fields without counting: the encapsulation header.
    `buffer` is the message as filled in last.
    """

    def __init__(self, prefix: bytes = HEADER, start: int = 0) -> None:
        self.buffer = bytearray(prefix)
        self._shift = start - len(prefix)

    def slot(self, codes: str) -> Callable[..., None]:
        """Append room for values of one width, e.g. "iI" or "7d"; returns the function that fills it."""
        self.align(struct.calcsize("<" + codes[-1]))
        offset = len(self.buffer)
        layout = struct.Struct("<" + codes)
        self.buffer += bytes(layout.size)
        return partial(layout.pack_into, self.buffer, offset)

    def put(self, codes: str, *values: float) -> None:
        """Append constants of one width."""
        self.slot(codes)(*values)

    def string(self, text: str) -> None:
        """Append a string: its length with the closing NUL, then its UTF-8 bytes."""
        encoded = text.encode() + b"\0"
        self.put("I", len(encoded))
        self.buffer += encoded

    def align(self, width: int) -> None:
        """Pad to a multiple of `width` bytes."""
        self.buffer += bytes(-(len(self.buffer) + self._shift) % width)


class Cursor:
    """Reads a message field by field, in the order of its definition. Raises struct.error past its end.

    `order` is "<" for little endian, as ROS 2 writes on all that it runs on, or ">".
    """

    def __init__(self, data: bytes, order: str = "<") -> None:
        self._data = data
        self._order = order
        self._offset = len(HEADER)

    @property
    def left(self) -> int:
        """How many bytes have not been read."""
        return len(self._data) - self._offset

    def take(self, codes: str) -> tuple[float, ...]:
        """The next values of one width, e.g. "7d"."""
        layout = struct.Struct(self._order + codes)
        self._align(struct.calcsize("<" + codes[-1]))
        values = layout.unpack_from(self._data, self._offset)
        self._offset += layout.size
        return values

    def count(self) -> int:
        """The length of the sequence that follows."""
        return int(self.take("I")[0])

    def string(self) -> str:
        """The next string, without its closing NUL."""
        size = self.count()
        (encoded,) = struct.unpack_from(f"{size}s", self._data, self._offset)
        self._offset += size
        return str(encoded[:-1], "utf-8")

    def array(self, kind: str, shape: tuple[int, ...]) -> npt.NDArray[np.generic]:
        """The next numbers of one kind, e.g. "<f8", in that shape."""
        dtype = np.dtype(kind)
        self._align(dtype.itemsize)
        size = math.prod(shape)
        if self._offset + size * dtype.itemsize > len(self._data):
            raise struct.error(f"message ends before its {size} numbers do")
        values = np.frombuffer(self._data, dtype, size, self._offset).reshape(shape)
        self._offset += values.nbytes
        return values

    def _align(self, width: int) -> None:
        self._offset += -(self._offset - len(HEADER)) % width
