"""Process of an external stack and the socket to it."""

import json
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from simscen.core.errors import RunError
from simscen.core.external_command import ExternalCommand
from simscen.peer import wire
from simscen.run.external import protocol
from simscen.run.process.captured_output import CappedLog, output_tail
from simscen.run.process.isolation import clean_environment

READ_BYTES = 1 << 20
TAIL_BYTES = 16_384
EXIT_TIMEOUT_S = 2.0
"""Time in which a process is expected to exit after it closed its socket."""
CLEANUP_TIMEOUT_S = 5.0
MAX_MESSAGE_LENGTH = 2000
PEER_PATH_VARIABLE = "SIMSCEN_PEER_PATH"
"""The environment variable with the folder of `simscen_peer`."""
ROBOT_VARIABLE = "SIMSCEN_ROBOT"
"""The environment variable with the name of the robot, where there are several."""


class StackProcess:
    """A running stack. Its output goes to the file `printed`; errors contain the end of it.

    All waits have a time limit. Frames, answers, and output are transferred concurrently, so that none blocks another.
    """

    def __init__(self, name: str, command: ExternalCommand, printed: Path | None, robot: str = "") -> None:
        """Start the command of a stack, for `robot` if there are several."""
        self._name = f"{name} of robot `{robot}`" if robot else name
        self._outbox, self._inbox, self._reports = bytearray(), bytearray(), bytearray()
        self._ended = ""
        self._hung_up = False
        self._dismissed = 0.0
        self._log = CappedLog(printed)
        self._stream, theirs = socket.socketpair()
        control, self._control = os.pipe()
        self._report, told = os.pipe()
        self._shown, shown = os.pipe()
        self._keeper = subprocess.Popen(
            [
                sys.executable,
                "-I",
                "-m",
                "simscen.run.external.launcher",
                str(control),
                str(told),
                str(theirs.fileno()),
            ],
            stdin=subprocess.DEVNULL,
            stdout=shown,
            stderr=shown,
            pass_fds=[control, told, theirs.fileno()],
            env=clean_environment(),
            start_new_session=True,
        )
        for descriptor in (control, told, shown):
            os.close(descriptor)
        theirs.close()
        self._stream.setblocking(False)
        for descriptor in (self._report, self._shown):
            os.set_blocking(descriptor, False)
        self._poll = select.poll()
        self._takers: dict[int, Callable[[], bool]] = {
            self._stream.fileno(): self._take_frames,
            self._report: self._take_report,
            self._shown: self._take_print,
        }
        for descriptor in self._takers:
            self._poll.register(descriptor, select.POLLIN)
        self._order(command, {ROBOT_VARIABLE: robot} if robot else {})

    def _order(self, command: ExternalCommand, more: dict[str, str]) -> None:
        inherited = {name: value for name, value in command.env.items() if name != ROBOT_VARIABLE}
        env = {**inherited, **more, PEER_PATH_VARIABLE: str(Path(wire.__file__).parent / "standalone")}
        told = {"argv": command.argv, "env": env, "cwd": command.cwd, "variable": wire.DESCRIPTOR}
        order = json.dumps(told).encode()
        os.write(self._control, struct.pack("<I", len(order)) + order)

    def exchange(self, frame: bytes, limit: float, what: str) -> tuple[int, bytes]:
        """Send a frame and return kind and body of the next one; `what` names the expected answer in errors.

        Raises RunError of a kind in simscen.run.external.protocol.
        """
        self.send(frame)
        self._pump(lambda: self._hung_up or self._has_frame(), limit)
        if not self._has_frame():
            raise self._gone() if self._hung_up else self.error(protocol.TIMEOUT, f"no {what} within {limit:g} s")
        kind, body = self._taken()
        if kind == wire.ERROR:
            raise self.error(protocol.FAILED, _message(body))
        return kind, body

    def send(self, frame: bytes) -> None:
        """Queue a frame and send as much as possible."""
        self._outbox += frame
        self._post()

    def dismiss(self, frame: bytes) -> None:
        """Send the last frame and start the grace period."""
        self.send(frame)
        self._dismissed = time.monotonic()

    def farewell(self, grace: float) -> bytes:
        """Wait up to `grace` seconds after `dismiss` until the stack hangs up; return the body of BYE or "{}"."""
        self._pump(lambda: self._hung_up, max(0.0, self._dismissed + grace - time.monotonic()))
        with suppress(RunError):
            if self._has_frame():
                kind, body = self._taken()
                return body if kind == wire.BYE else b"{}"
        return b"{}"

    def error(self, kind: str, message: str) -> RunError:
        """Return an error of this stack, with the end of its output."""
        self._pump(lambda: False, 0.0)
        printed = self._log.last(TAIL_BYTES).decode(errors="replace")
        return RunError(kind, f"stack {self._name}: {message}", output_tail(printed), by_stack=True)

    def release(self) -> None:
        """Request the end of the process and its descendants; `close` waits for it."""
        if self._control >= 0:
            with suppress(BrokenPipeError):
                os.write(self._control, b"\0")
            os.close(self._control)
            self._control = -1

    def close(self) -> None:
        """End the process and its descendants."""
        self.release()
        self._pump(lambda: self._shown not in self._takers and self._report not in self._takers, CLEANUP_TIMEOUT_S)
        self._keeper.kill()
        self._keeper.wait()
        for descriptor in (self._report, self._shown):
            os.close(descriptor)
        self._stream.close()
        self._log.close()

    def _gone(self) -> RunError:
        self._pump(lambda: bool(self._ended) or self._report not in self._takers, EXIT_TIMEOUT_S)
        kept = self._report in self._takers
        unsaid = "its process has closed its socket, but still runs" if kept else "what keeps its process has ended"
        return self.error(protocol.CRASHED, self._ended or unsaid)

    def _pump(self, done: Callable[[], bool], limit: float) -> None:
        """Transfer data until `done` or until `limit` seconds have passed."""
        end = time.monotonic() + limit
        while not done():
            left = end - time.monotonic()
            ready = self._poll.poll(max(0.0, left) * 1e3)
            for descriptor, events in ready:
                self._serve(descriptor, events)
            if left <= 0:
                return

    def _serve(self, descriptor: int, events: int) -> None:
        if events & select.POLLOUT:
            self._post()
        if events & ~select.POLLOUT and not self._takers[descriptor]():
            self._poll.unregister(descriptor)
            del self._takers[descriptor]

    def _post(self) -> None:
        """Send as much as the socket accepts."""
        try:
            while self._outbox and not self._hung_up:
                del self._outbox[: self._stream.send(self._outbox[:READ_BYTES])]
        except BlockingIOError:
            pass
        except OSError:  # it closed the socket; its last frames can still be read
            self._outbox.clear()
        if self._stream.fileno() in self._takers:
            self._poll.modify(self._stream, select.POLLIN | (select.POLLOUT if self._outbox else 0))

    def _take_frames(self) -> bool:
        try:
            data = self._stream.recv(READ_BYTES)
        except ConnectionResetError:
            data = b""
        self._inbox += data
        self._hung_up = not data
        return bool(data)

    def _take_report(self) -> bool:
        data = os.read(self._report, READ_BYTES)
        self._reports += data
        *lines, rest = self._reports.split(b"\n")
        self._reports = bytearray(rest)
        for line in lines:
            self._ended = _ended(json.loads(line))
        return bool(data)

    def _take_print(self) -> bool:
        data = os.read(self._shown, READ_BYTES)
        self._log.take(data)
        return bool(data)

    def _has_frame(self) -> bool:
        return len(self._inbox) >= wire.SIZE.size and len(self._inbox) >= wire.SIZE.size + self._size()

    def _size(self) -> int:
        (size,) = wire.SIZE.unpack_from(self._inbox)
        if not 1 <= size <= wire.LONGEST:
            raise self.error(protocol.PROTOCOL, f"a frame of {size} bytes: what it sends are no frames of the protocol")
        return int(size)

    def _taken(self) -> tuple[int, bytes]:
        end = wire.SIZE.size + self._size()
        kind, body = self._inbox[wire.SIZE.size], bytes(self._inbox[wire.SIZE.size + 1 : end])
        del self._inbox[:end]
        return kind, body


def _ended(report: dict[str, Any]) -> str:
    """Describe a report of the launcher."""
    if "failed" in report:
        return f"its process cannot be started: {report['failed']}"
    code = report["exit"]
    return f"its process was killed ({signal.Signals(-code).name})" if code < 0 else f"its process exited {code}"


def _message(body: bytes) -> str:
    try:
        return str(wire.from_json(body)["message"])[:MAX_MESSAGE_LENGTH]
    except (wire.Malformed, KeyError):
        return "it cannot go on, and does not say why"
