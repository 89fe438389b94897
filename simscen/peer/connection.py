"""The socket of a peer: whole frames in, whole frames out."""

from __future__ import annotations

import os
import socket
from typing import Any

from . import wire


class Gone(ConnectionError):
    """The other side has hung up."""


class Refused(RuntimeError):
    """simscen ends the run for what this peer said; the message tells why."""


class Connection:
    """A stream socket that carries frames of the protocol. It blocks: the simulation waits for this side anyway."""

    def __init__(self, stream: socket.socket) -> None:
        self._stream = stream

    @classmethod
    def inherited(cls) -> Connection:
        """The socket that simscen left open for this process.

        Raises RuntimeError when it was not simscen that started it.
        """
        number = os.environ.get(wire.DESCRIPTOR, "")
        if not number.isdigit():
            raise RuntimeError(f"{wire.DESCRIPTOR} is not set: this program is started by simscen (run --stack)")
        return cls(socket.socket(fileno=int(number)))

    def send(self, frame: bytes) -> None:
        """Send a frame. Raises Gone."""
        try:
            self._stream.sendall(frame)
        except OSError as error:
            raise Gone(str(error)) from error

    def send_json(self, kind: int, content: dict[str, Any]) -> None:
        """Send a frame with an object in JSON."""
        self.send(wire.json_frame(kind, content))

    def receive(self) -> tuple[int, bytes]:
        """The kind and the body of the next frame. Raises Gone, and Refused for an ERROR."""
        (size,) = wire.SIZE.unpack(self._exactly(wire.SIZE.size))
        if not 1 <= size <= wire.LONGEST:
            raise wire.Malformed(f"a frame of {size} bytes")
        content = self._exactly(size)
        kind, body = content[0], content[1:]
        if kind == wire.ERROR:
            raise Refused(str(wire.from_json(body).get("message", "")))
        return kind, body

    def close(self) -> None:
        """Hang up."""
        self._stream.close()

    def _exactly(self, size: int) -> bytes:
        parts, left = [], size
        while left:
            try:
                part = self._stream.recv(min(left, 1 << 20))
            except OSError as error:
                raise Gone(str(error)) from error
            if not part:
                raise Gone("simscen has hung up")
            parts.append(part)
            left -= len(part)
        return b"".join(parts)
