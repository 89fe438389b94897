"""Template of a ROS 2 message of fixed size, and generated functions that pack (serialize) such messages in one call.

This is faster than the Writer of simscen.peer.cdr, which serializes field by field.
"""

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import groupby
from typing import Any, NamedTuple

from simscen.peer.cdr import HEADER, Writer


class Slot(NamedTuple):
    """Space in a Template for the value of a field: format codes as in `struct`, and the name of the field.

    The name starts with an asterisk if the value is a sequence, e.g. "*pose".
    """

    codes: str
    field: str


class Template(Writer):
    """Layout of a message of fixed size: constants, and slots for variable fields. `buffer` has zeros in the slots.

    prefix:  bytes before the message, such as the CDR header, which do not count for the alignment
    start:   number of bytes of the message before this template, if the template is a part of a message
    """

    def __init__(self, prefix: bytes = HEADER, start: int = 0) -> None:
        super().__init__()
        self.buffer = bytearray(prefix)
        self._alignment_offset = start - len(prefix)
        self._slots: list[tuple[int, Slot]] = []

    def slot(self, codes: str, field: str) -> "Template":
        """Append a slot for a field, whose numbers have equal widths. `codes` is a `struct` format such as "7d24x"."""
        self.align(max(struct.calcsize("<" + code) for code in codes if code.isalpha()))
        self._slots.append((len(self.buffer), Slot(codes, field)))
        self.buffer += bytes(struct.calcsize("<" + codes))
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
        """Return a function that packs a message. Its arguments are the values of `field_names(self.parts)`."""
        return compile_packer(tuple(self.parts))


@lru_cache(maxsize=256)
def compile_packer(parts: "tuple[bytes | Slot, ...]") -> Callable[..., bytes]:
    """Return a function that packs the parts into bytes. Its arguments are the values of `field_names(parts)`."""
    return _compile(parts, "pack", ())


@lru_cache(maxsize=256)
def compile_writer(parts: "tuple[bytes | Slot, ...]") -> Callable[..., None]:
    """Return a function that packs the parts into a buffer.

    Its arguments are the buffer, an offset in it, and the values of `field_names(parts)`.
    """
    return _compile(parts, "pack_into", ("buffer", "offset"))


def _compile(parts: "tuple[bytes | Slot, ...]", method: str, first_parameters: tuple[str, ...]) -> Callable[..., Any]:
    """Generate a function that packs all parts with a single call of the struct function `method`.

    `first_parameters` are the names of the parameters of the function before the fields.
    """
    codes, arguments, constants = "<", [*first_parameters], dict[str, Any]()
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
    parameters = *first_parameters, *field_names(parts)
    source = f"lambda {', '.join(parameters)}: {method}({', '.join(arguments)})"
    function: Callable[..., Any] = eval(source, {**constants, method: getattr(struct.Struct(codes), method)})
    return function


def field_names(parts: "Sequence[bytes | Slot]") -> list[str]:
    """Return the distinct names of the slots in order, without asterisks. Slots with equal names have equal values."""
    return list(dict.fromkeys(part.field.removeprefix("*") for part in parts if isinstance(part, Slot)))
