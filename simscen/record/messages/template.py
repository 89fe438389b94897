"""Template of a ROS 2 message of fixed size, and generated functions that pack such messages in one call.

The Writer of simscen.peer.cdr serializes field by field, which takes ten times as long as writing the message to a log.
Therefore, the layout of a message is computed once, as a Template, and reused for all messages.
"""

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import groupby
from typing import Any, NamedTuple

from simscen.peer.cdr import HEADER


class Slot(NamedTuple):
    """Space in a Template for the value of a field: format codes as in `struct`, and the name of the field.

    The name starts with an asterisk if the value is a sequence of numbers: "*pose".
    """

    codes: str
    field: str


class Template:
    """Layout of a message of fixed size: constants, and slots for the fields whose values vary.

    Methods append fields in the order of the message definition, and return the template so that calls can be chained.
    Each field is aligned to its own width. For a part of a message, `start` is the number of bytes of the message
    before this part. `prefix` does not count for the alignment: the CDR header. `buffer` is the message with zeros in
    its slots.
    """

    def __init__(self, prefix: bytes = HEADER, start: int = 0) -> None:
        self.buffer = bytearray(prefix)
        self._shift = start - len(prefix)
        self._slots: list[tuple[int, Slot]] = []

    def slot(self, codes: str, field: str) -> "Template":
        """Append a slot for numbers of one width, for example "iI" or "7d". "8x" stands for eight bytes of zeros."""
        self.align(max(struct.calcsize("<" + code) for code in codes if code.isalpha()))
        self._slots.append((len(self.buffer), Slot(codes, field)))
        self.buffer += bytes(struct.calcsize("<" + codes))
        return self

    def put(self, codes: str, *values: float) -> "Template":
        """Append constant numbers of one width, whose types are codes of `struct`."""
        self.align(struct.calcsize("<" + codes[-1]))
        self.buffer += struct.pack("<" + codes, *values)
        return self

    def string(self, text: str) -> "Template":
        """Append a constant string: its length with the terminating NUL, then its UTF-8 bytes."""
        encoded = text.encode() + b"\0"
        self.put("I", len(encoded))
        self.buffer += encoded
        return self

    def align(self, width: int) -> "Template":
        """Append zeros up to a multiple of `width` bytes."""
        self.buffer += bytes(-(len(self.buffer) + self._shift) % width)
        return self

    @property
    def parts(self) -> "list[bytes | Slot]":
        """Constants and slots in order."""
        parts: list[bytes | Slot] = []
        end = 0
        for offset, slot in self._slots:
            parts += (bytes(self.buffer[end:offset]), slot)
            end = offset + struct.calcsize("<" + slot.codes)
        return [*parts, bytes(self.buffer[end:])]

    def packer(self) -> Callable[..., bytes]:
        """Return a function that packs a message. Its arguments are the values of the fields, as in `field_names`."""
        return compile_packer(tuple(self.parts))


@lru_cache(maxsize=256)
def compile_packer(parts: "tuple[bytes | Slot, ...]") -> Callable[..., bytes]:
    """Return a function that packs the parts into bytes. Its arguments are the values of `field_names(parts)`.

    The function is cached, because its compilation is slow.
    """
    return _compile(parts, "pack", ())


@lru_cache(maxsize=256)
def compile_writer(parts: "tuple[bytes | Slot, ...]") -> Callable[..., None]:
    """Return a function that packs the parts into a buffer.

    Its arguments are the buffer, an offset in it, and the values of `field_names(parts)`.
    """
    return _compile(parts, "pack_into", ("buffer", "offset"))


def _compile(parts: "tuple[bytes | Slot, ...]", method: str, leading: tuple[str, ...]) -> Callable[..., Any]:
    """Generate a function that packs all parts with a single call of `struct`.

    The function is evaluated from source text, as in `collections.namedtuple`. Only field names vary in the text.
    """
    codes, arguments, constants = "<", [*leading], dict[str, Any]()
    for is_constant, group in groupby(parts, lambda part: isinstance(part, bytes)):
        if is_constant:
            data = b"".join(part for part in group if isinstance(part, bytes))
            codes += f"{len(data)}{'s' if any(data) else 'x'}"
            if any(data):
                constants[f"constant{len(constants)}"] = data
                arguments.append(f"constant{len(constants) - 1}")
        else:
            slots = [part for part in group if isinstance(part, Slot)]
            codes += "".join(slot.codes for slot in slots)
            arguments += [slot.field for slot in slots]
    parameters = *leading, *dict.fromkeys(field_names(parts))
    source = f"lambda {', '.join(parameters)}: {method}({', '.join(arguments)})"
    function: Callable[..., Any] = eval(source, {**constants, method: getattr(struct.Struct(codes), method)})
    return function


def field_names(parts: "Sequence[bytes | Slot]") -> list[str]:
    """Return the names of the fields in the order of their first slots, without asterisks.

    Slots with the same name are one field: they get the same value.
    """
    return list(dict.fromkeys(part.field.removeprefix("*") for part in parts if isinstance(part, Slot)))
