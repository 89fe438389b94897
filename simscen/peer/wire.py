"""Frames of the stack protocol between simscen and a stack in a process of its own.

docs/reference/stack-protocol.md defines the protocol. Both sides use this module, on Python 3.8 and later.
"""

from __future__ import annotations

import json
import os
import socket
import struct
from typing import TYPE_CHECKING, Any, NamedTuple

PROTOCOL = 1
"""Version of the protocol."""
SOCKET_FD_VARIABLE = "SIMSCEN_STACK_FD"
"""Environment variable with the file descriptor of the inherited socket."""

HELLO, WELCOME, GOAL, STEP, ANSWER, PREEMPT, CANCEL, END, ERROR, BYE = range(1, 11)
"""Kinds of frames."""
KIND_NAMES = ("", "HELLO", "WELCOME", "GOAL", "STEP", "ANSWER", "PREEMPT", "CANCEL", "END", "ERROR", "BYE")

COMMAND_DUE = 1
"""Flag of a STEP: its answer must contain a command."""
MAX_FRAME_BYTES = 256 << 20
"""Largest frame in bytes."""

MAX_JSON_DEPTH = 32
"""Largest nesting depth of JSON."""

SIZE = struct.Struct("<I")
_STEP = struct.Struct("<QiIIII")
_ANSWER = struct.Struct("<QI")
_MESSAGE = struct.Struct("<II")

if TYPE_CHECKING:
    Messages = list[tuple[int, bytes]]  # numbers of topics, each with one message as CDR


class Malformed(ValueError):
    """A frame that violates the protocol."""


class StepHeader(NamedTuple):
    """Time of a step: the tick, and the simulated time in whole seconds and nanoseconds.

    `deadline` is the wall time in milliseconds that the answer may take; `flags` is 0 or COMMAND_DUE.
    """

    tick: int
    sec: int
    nanosec: int
    deadline: int
    flags: int


def frame(kind: int, body: bytes) -> bytes:
    """Return a frame: size, kind, body."""
    return SIZE.pack(len(body) + 1) + bytes((kind,)) + body


def json_frame(kind: int, content: dict[str, Any]) -> bytes:
    """Return a frame with a JSON object."""
    return frame(kind, json.dumps(content, separators=(",", ":"), allow_nan=False).encode())


def from_json(body: bytes) -> dict[str, Any]:
    """Return the object of a JSON frame. Raises Malformed for invalid or too deeply nested JSON."""
    try:
        content = json.loads(body.decode(), parse_constant=_reject_constant)
        json.dumps(content, ensure_ascii=False).encode()
    except (ValueError, RecursionError) as error:
        raise Malformed(f"its body is not JSON: {error}") from None
    if not isinstance(content, dict):
        raise Malformed("its body is not a JSON object")
    if _is_nested_deeper(content, MAX_JSON_DEPTH):
        raise Malformed(f"its body is nested deeper than {MAX_JSON_DEPTH}")
    return content


def _reject_constant(word: str) -> None:
    raise ValueError(f"{word} is not a JSON number")


def _is_nested_deeper(content: Any, remaining: int) -> bool:
    inner = content.values() if isinstance(content, dict) else content if isinstance(content, list) else ()
    return remaining == 0 or any(_is_nested_deeper(item, remaining - 1) for item in inner)


def step_frame(header: StepHeader, messages: Messages) -> bytes:
    """Return a STEP."""
    return frame(STEP, _STEP.pack(*header, len(messages)) + _pack_messages(messages))


def answer_frame(tick: int, messages: Messages) -> bytes:
    """Return an ANSWER to the STEP of that tick."""
    return frame(ANSWER, _ANSWER.pack(tick, len(messages)) + _pack_messages(messages))


def from_step(body: bytes) -> tuple[StepHeader, Messages]:
    """Return header and messages of a STEP. Raises Malformed."""
    *header, count = _unpack_struct(_STEP, body, 0)
    return StepHeader(*header), _unpack_messages(body, _STEP.size, count)


def from_answer(body: bytes) -> tuple[int, Messages]:
    """Return tick and messages of an ANSWER. Raises Malformed."""
    tick, count = _unpack_struct(_ANSWER, body, 0)
    return tick, _unpack_messages(body, _ANSWER.size, count)


def _pack_messages(messages: Messages) -> bytes:
    return b"".join(_MESSAGE.pack(number, len(data)) + data for number, data in messages)


def _unpack_messages(body: bytes, offset: int, count: int) -> Messages:
    messages = []
    for _ in range(count):
        number, size = _unpack_struct(_MESSAGE, body, offset)
        offset += _MESSAGE.size + size
        if offset > len(body):
            raise Malformed("it ends before its last message is complete")
        messages.append((number, body[offset - size : offset]))
    if offset != len(body):
        raise Malformed("there are more bytes after its last message")
    return messages


def _unpack_struct(layout: struct.Struct, body: bytes, offset: int) -> tuple[Any, ...]:
    if offset + layout.size > len(body):
        raise Malformed("it ends before its header is complete")
    return layout.unpack_from(body, offset)


class Disconnected(ConnectionError):
    """The other side has closed the connection."""


class Refused(RuntimeError):
    """simscen ends the run because of something that this stack sent; the message gives the reason."""


class Connection:
    """A stream socket for frames of the protocol. It blocks, because the simulation waits for the answer anyway."""

    def __init__(self, stream: socket.socket) -> None:
        self._stream = stream

    @classmethod
    def inherited(cls) -> Connection:
        """Return the connection that this process inherited from simscen.

        Raises RuntimeError if simscen did not start this process.
        """
        number = os.environ.get(SOCKET_FD_VARIABLE, "")
        if not (number.isascii() and number.isdecimal()):
            raise RuntimeError(f"{SOCKET_FD_VARIABLE} is not set: start this program with `simscen run --stack`")
        return cls(socket.socket(fileno=int(number)))

    def send(self, frame: bytes) -> None:
        """Send a frame. Raises Disconnected."""
        try:
            self._stream.sendall(frame)
        except OSError as error:
            raise Disconnected(str(error)) from error

    def send_json(self, kind: int, content: dict[str, Any]) -> None:
        """Send a frame with a JSON object."""
        self.send(json_frame(kind, content))

    def receive(self) -> tuple[int, bytes]:
        """Return kind and body of the next frame. Raises Disconnected, and Refused for an ERROR."""
        (size,) = SIZE.unpack(self._receive_exactly(SIZE.size))
        if not 1 <= size <= MAX_FRAME_BYTES:
            raise Malformed(f"a frame of {size} bytes")
        content = self._receive_exactly(size)
        kind, body = content[0], content[1:]
        if kind == ERROR:
            raise Refused(str(from_json(body).get("message", "")))
        return kind, body

    def close(self) -> None:
        """Close the connection."""
        self._stream.close()

    def _receive_exactly(self, size: int) -> bytes:
        parts, remaining = [], size
        while remaining:
            try:
                part = self._stream.recv(min(remaining, 1 << 20))
            except OSError as error:
                raise Disconnected(str(error)) from error
            if not part:
                raise Disconnected("simscen has closed the connection")
            parts.append(part)
            remaining -= len(part)
        return b"".join(parts)
