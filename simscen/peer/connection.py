"""Socket between simscen and a stack, which transfers whole frames."""

from __future__ import annotations

import os
import socket
from typing import Any

from . import wire


class Gone(ConnectionError):
    """The other side has closed the connection."""


class Refused(RuntimeError):
    """simscen ends the run because of something that this stack sent; the message gives the reason."""


class Connection:
    """A stream socket for frames of the protocol. It blocks, because the simulation waits for this side anyway."""

    def __init__(self, stream: socket.socket) -> None:
        self._stream = stream

    @classmethod
    def inherited(cls) -> Connection:
        """Return the connection that this process inherited from simscen.

        Raises RuntimeError if simscen did not start this process.
        """
        number = os.environ.get(wire.DESCRIPTOR, "")
        if not (number.isascii() and number.isdecimal()):
            raise RuntimeError(f"{wire.DESCRIPTOR} is not set: this program is started by simscen (run --stack)")
        return cls(socket.socket(fileno=int(number)))

    def send(self, frame: bytes) -> None:
        """Send a frame. Raises Gone."""
        try:
            self._stream.sendall(frame)
        except OSError as error:
            raise Gone(str(error)) from error

    def send_json(self, kind: int, content: dict[str, Any]) -> None:
        """Send a frame with a JSON object."""
        self.send(wire.json_frame(kind, content))

    def receive(self) -> tuple[int, bytes]:
        """Return kind and body of the next frame. Raises Gone, and Refused for an ERROR."""
        (size,) = wire.SIZE.unpack(self._exactly(wire.SIZE.size))
        if not 1 <= size <= wire.LONGEST:
            raise wire.Malformed(f"a frame of {size} bytes")
        content = self._exactly(size)
        kind, body = content[0], content[1:]
        if kind == wire.ERROR:
            raise Refused(str(wire.from_json(body).get("message", "")))
        return kind, body

    def close(self) -> None:
        """Close the connection."""
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
