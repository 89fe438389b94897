"""Common Data Representation as ROS 2 writes it: XCDR version 1, little endian (OMG DDSI-RTPS 10.5).

Building messages field by field costs ten times what writing them does, so a message type is laid out once, as a
Template, and each message is then packed in one call.
"""

import math
import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

HEADER = b"\x00\x01\x00\x00"


class Slot(NamedTuple):
    """Room for a field of a message: the codes of its numbers, as in `struct`, and its name.

    The name of a field of several numbers begins with a star: "*pose".
    """

    codes: str
    field: str


class Template:
    """A message of fixed size: constants are in place, slots are for what each message fills in.

    Fields are appended in the order of the message definition and aligned to their own width, counted from `start`
    bytes before the first field. `prefix` is what precedes the fields without counting: the encapsulation header.
    `buffer` is the message with zeros in its slots.
    """

    def __init__(self, prefix: bytes = HEADER, start: int = 0) -> None:
        self.buffer = bytearray(prefix)
        self._shift = start - len(prefix)
        self._slots: list[tuple[int, Slot]] = []

    def slot(self, codes: str, field: str) -> None:
        """Append room for numbers of one width, e.g. "iI" or "7d"; "8x" among them are eight bytes that stay zero."""
        self.align(max(struct.calcsize("<" + code) for code in codes if code.isalpha()))
        self._slots.append((len(self.buffer), Slot(codes, field)))
        self.buffer += bytes(struct.calcsize("<" + codes))

    def put(self, codes: str, *values: float) -> None:
        """Append constants of one width."""
        self.align(struct.calcsize("<" + codes[-1]))
        self.buffer += struct.pack("<" + codes, *values)

    def string(self, text: str) -> None:
        """Append a string: its length with the closing NUL, then its UTF-8 bytes."""
        encoded = text.encode() + b"\0"
        self.put("I", len(encoded))
        self.buffer += encoded

    def align(self, width: int) -> None:
        """Pad to a multiple of `width` bytes."""
        self.buffer += bytes(-(len(self.buffer) + self._shift) % width)

    @property
    def parts(self) -> "list[bytes | Slot]":
        """Constants and slots, in order."""
        parts: list[bytes | Slot] = []
        end = 0
        for offset, slot in self._slots:
            parts += (bytes(self.buffer[end:offset]), slot)
            end = offset + struct.calcsize("<" + slot.codes)
        return [*parts, bytes(self.buffer[end:])]

    def packer(self) -> Callable[..., bytes]:
        """What packs a message: it takes the fields of the slots, in their order."""
        return compile_packer(tuple(self.parts))


@lru_cache(maxsize=256)
def compile_packer(parts: "tuple[bytes | Slot, ...]") -> Callable[..., bytes]:
    """What packs constants and fields into bytes: it takes the fields in the order in which they come first."""
    return _compile(parts, "pack", ())


@lru_cache(maxsize=256)
def compile_writer(parts: "tuple[bytes | Slot, ...]") -> Callable[..., None]:
    """What packs constants and fields into a buffer: it takes the buffer, an offset in it, and the fields as above."""
    return _compile(parts, "pack_into", ("buffer", "offset"))


def _compile(parts: "tuple[bytes | Slot, ...]", how: str, where: tuple[str, ...]) -> Callable[..., Any]:
    """It is made as Python's named tuples are, from text in which nothing but the names of fields varies: everything
    then goes through a single call of `struct`.
    """
    codes, arguments, known = "<", [*where], dict[str, Any]()
    for constant, group in groupby(parts, lambda part: isinstance(part, bytes)):
        if constant:
            data = b"".join(part for part in group if isinstance(part, bytes))
            codes += f"{len(data)}{'s' if any(data) else 'x'}"
            if any(data):
                known[f"constant{len(known)}"] = data
                arguments.append(f"constant{len(known) - 1}")
        else:
            slots = [part for part in group if isinstance(part, Slot)]
            codes += "".join(slot.codes for slot in slots)
            arguments += [slot.field for slot in slots]
    taken = *where, *dict.fromkeys(field_names(parts))
    text = f"lambda {', '.join(taken)}: {how}({', '.join(arguments)})"
    made: Callable[..., Any] = eval(text, {**known, how: getattr(struct.Struct(codes), how)})
    return made


def field_names(parts: "Sequence[bytes | Slot]") -> list[str]:
    """The names of the fields, in the order in which they come first."""
    return list(dict.fromkeys(part.field.removeprefix("*") for part in parts if isinstance(part, Slot)))


class CdrReader:
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
