"""Wire format of the stack protocol: packs, unpacks, sends, and receives the frames between simscen and a stack.

A frame is a packet of the protocol: size, kind, and body. docs/reference/stack-protocol.md defines the protocol. The
module must run on Python 3.8.
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
"""Kinds of frames, in the first byte after the size."""
KIND_NAMES = ("", "HELLO", "WELCOME", "GOAL", "STEP", "ANSWER", "PREEMPT", "CANCEL", "END", "ERROR", "BYE")
"""Names of the kinds of frames, by number."""

COMMAND_DUE = 1
"""Flag of a STEP frame: the answer must contain a velocity command."""
MAX_FRAME_BYTES = 256 << 20
"""Maximum size of the kind and the body of a frame."""
MAX_JSON_DEPTH = 32
"""Maximum number of levels of JSON content. The innermost value counts as a level."""

SIZE = struct.Struct("<I")
"""First field of a frame: size of the kind and the body in bytes."""
_STEP = struct.Struct("<QiIIII")
"""Header of a STEP frame: the fields of StepHeader, and the number of messages."""
_ANSWER = struct.Struct("<QI")
"""Header of an ANSWER frame: tick, and number of messages."""
_MESSAGE = struct.Struct("<II")
"""Header of a message: number of the topic, and size of the message in bytes."""

if TYPE_CHECKING:
    Messages = list[tuple[int, bytes]]  # each message is the number of its topic, and its bytes (CDR)


class Malformed(ValueError):
    """A frame violates the protocol."""


class StepHeader(NamedTuple):
    """Header of a STEP frame.

    tick:          number of physics steps since the start of the run
    sec, nanosec:  simulated time, as in a ROS stamp
    deadline:      maximum wall-clock time for the answer in milliseconds
    flags:         0 or COMMAND_DUE
    """

    tick: int
    sec: int
    nanosec: int
    deadline: int
    flags: int


def frame(kind: int, body: bytes) -> bytes:
    """Return the bytes of a frame: its size, its kind, and its body."""
    return SIZE.pack(len(body) + 1) + bytes((kind,)) + body


def json_frame(kind: int, content: dict[str, Any]) -> bytes:
    """Return a frame whose body is a JSON object."""
    return frame(kind, json.dumps(content, separators=(",", ":"), allow_nan=False).encode())


def from_json(body: bytes) -> dict[str, Any]:
    """Return the JSON object in the body of a frame. Raises Malformed for invalid or too deeply nested JSON."""
    try:
        content = json.loads(body.decode())
        # Raises ValueError for nan, infinity, and numbers such as 1e999, and for text that UTF-8 cannot represent.
        json.dumps(content, ensure_ascii=False, allow_nan=False).encode()
    except (ValueError, RecursionError) as error:
        raise Malformed(f"its body is not JSON: {error}") from None
    if not isinstance(content, dict):
        raise Malformed("its body is not a JSON object")
    if _has_more_levels(content, MAX_JSON_DEPTH):
        raise Malformed(f"its body is nested deeper than {MAX_JSON_DEPTH}")
    return content


def _has_more_levels(content: Any, limit: int) -> bool:
    """Return whether JSON content has more than `limit` levels. A number has one level, a list of numbers has two."""
    inner = content.values() if isinstance(content, dict) else content if isinstance(content, list) else ()
    return limit == 0 or any(_has_more_levels(item, limit - 1) for item in inner)


def step_frame(header: StepHeader, messages: Messages) -> bytes:
    """Return a STEP frame."""
    return frame(STEP, _STEP.pack(*header, len(messages)) + _pack_messages(messages))


def answer_frame(tick: int, messages: Messages) -> bytes:
    """Return an ANSWER frame to the STEP of this tick."""
    return frame(ANSWER, _ANSWER.pack(tick, len(messages)) + _pack_messages(messages))


def from_step(body: bytes) -> tuple[StepHeader, Messages]:
    """Return the header and the messages of a STEP. Raises Malformed if the body is invalid."""
    *header, count = _unpack_struct(_STEP, body, 0)
    return StepHeader(*header), _unpack_messages(body, _STEP.size, count)


def from_answer(body: bytes) -> tuple[int, Messages]:
    """Return the tick and the messages of an ANSWER. Raises Malformed if the body is invalid."""
    tick, count = _unpack_struct(_ANSWER, body, 0)
    return tick, _unpack_messages(body, _ANSWER.size, count)


def _pack_messages(messages: Messages) -> bytes:
    return b"".join(_MESSAGE.pack(number, len(data)) + data for number, data in messages)


def _unpack_messages(body: bytes, offset: int, count: int) -> Messages:
    """Return the messages that begin at `offset`. Raises Malformed if the last message does not end with the body."""
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
    """Return the fields of a header at `offset`. Raises Malformed if the body is too short."""
    if offset + layout.size > len(body):
        raise Malformed("it ends before its header is complete")
    return layout.unpack_from(body, offset)


class Disconnected(ConnectionError):
    """The other side has closed the connection."""


class Refused(RuntimeError):
    """simscen has sent ERROR, or the stack has given up. The run ends. The message states the reason."""


class Connection:
    """Blocking stream socket that sends and receives frames."""

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
        """Send the bytes of a frame. Raises Disconnected if the socket is closed."""
        try:
            self._stream.sendall(frame)
        except OSError as error:
            raise Disconnected(str(error)) from error

    def send_json(self, kind: int, content: dict[str, Any]) -> None:
        """Send a frame whose body is a JSON object. Raises Disconnected if the socket is closed."""
        self.send(json_frame(kind, content))

    def receive(self) -> tuple[int, bytes]:
        """Return the kind and the body of the next frame.

        Raises Refused for an ERROR frame, Malformed for an invalid size, and Disconnected if the socket is closed.
        """
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
