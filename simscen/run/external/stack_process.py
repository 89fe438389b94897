"""Start the process of an external stack, exchange frames with it over a socket, and end it."""

import json
import os
import select
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
from simscen.run.process.captured_output import READ_BYTES, TAIL_BYTES, CappedLog, output_tail, signal_name
from simscen.run.process.isolation import clean_environment

EXIT_TIMEOUT_S = 2.0
"""Time to wait until a stack that has closed its socket exits."""
CLEANUP_TIMEOUT_S = 5.0
"""Time to wait until the launcher (see StackProcess) has ended the stack and all of its descendants."""
MAX_MESSAGE_LENGTH = 2000
"""Maximum number of characters of an error message of a stack. The rest is cut off."""
PEER_PATH_VARIABLE = "SIMSCEN_PEER_PATH"
"""Environment variable with the folder of the Python module `simscen_peer`."""
ROBOT_VARIABLE = "SIMSCEN_ROBOT"
"""Environment variable with the name of the robot, if there are several robots."""


class StackProcess:
    """A running stack. Its output goes to `log_file`; error messages contain the last lines of the output.

    The stack is the child of a launcher: a process of simscen.run.external.launcher that starts the stack, reports its
    exit, and ends the stack and all of its descendants.
    """

    def __init__(self, name: str, command: ExternalCommand, log_file: Path | None, robot: str = "") -> None:
        """Start the command of the stack `name`. `robot` is the name of the robot if there are several robots."""
        self._name = f"{name} of robot `{robot}`" if robot else name
        self._send_buffer, self._receive_buffer, self._report_buffer = bytearray(), bytearray(), bytearray()
        self._exit_message = ""
        self._is_disconnected = False
        self._end_sent_at = 0.0
        self._log = CappedLog(log_file)
        self._stream, stack_socket = socket.socketpair()
        control, self._control = os.pipe()
        self._report, report_writer = os.pipe()
        self._output, output_writer = os.pipe()
        descriptors = (control, report_writer, stack_socket.fileno())
        self._launcher = subprocess.Popen(
            [sys.executable, "-I", "-m", "simscen.run.external.launcher", *map(str, descriptors)],
            stdin=subprocess.DEVNULL,
            stdout=output_writer,
            stderr=output_writer,
            pass_fds=descriptors,
            env=clean_environment(),
            start_new_session=True,
        )
        for descriptor in (control, report_writer, output_writer):
            os.close(descriptor)
        stack_socket.close()
        self._stream.setblocking(False)
        for descriptor in (self._report, self._output):
            os.set_blocking(descriptor, False)
        self._poll = select.poll()
        self._readers: dict[int, Callable[[], bool]] = {
            self._stream.fileno(): self._read_frames,
            self._report: self._read_exit_report,
            self._output: self._read_output,
        }
        for descriptor in self._readers:
            self._poll.register(descriptor, select.POLLIN)
        self._send_command_to_launcher(command, {ROBOT_VARIABLE: robot} if robot else {})

    def _send_command_to_launcher(self, command: ExternalCommand, extra: dict[str, str]) -> None:
        inherited = {name: value for name, value in command.env.items() if name != ROBOT_VARIABLE}
        env = {**inherited, **extra, PEER_PATH_VARIABLE: str(Path(wire.__file__).parent / "standalone")}
        order = {"argv": command.argv, "env": env, "cwd": command.cwd, "variable": wire.SOCKET_FD_VARIABLE}
        encoded = json.dumps(order).encode()
        os.write(self._control, struct.pack("<I", len(encoded)) + encoded)

    def exchange(self, frame: bytes, limit_s: float, expected: str) -> tuple[int, bytes]:
        """Send a frame, and return the kind and the body of the next received frame.

        Raises RunError of a kind in simscen.run.external.protocol, for example if no frame arrives within `limit_s`
        seconds. `expected` describes the expected frame in the error message.
        """
        self.send(frame)
        self._pump(lambda: self._is_disconnected or self._has_frame(), limit_s)
        if not self._has_frame():
            if self._is_disconnected:
                raise self._crash_error()
            raise self.error(protocol.TIMEOUT, f"no {expected} within {limit_s:g} s")
        kind, body = self._pop_frame()
        if kind == wire.ERROR:
            raise self.error(protocol.FAILED, _error_message(body))
        return kind, body

    def send(self, frame: bytes) -> None:
        """Queue a frame, and send as much as possible."""
        self._send_buffer += frame
        self._flush()

    def send_end(self, frame: bytes) -> None:
        """Send the frame END, and start the grace period of `receive_bye`."""
        self.send(frame)
        self._end_sent_at = time.monotonic()

    def receive_bye(self, grace_s: float) -> bytes:
        """Wait until the stack disconnects, up to `grace_s` after `send_end`; return the body of its BYE, or "{}"."""
        self._pump(lambda: self._is_disconnected, max(0.0, self._end_sent_at + grace_s - time.monotonic()))
        with suppress(RunError):
            if self._has_frame():
                kind, body = self._pop_frame()
                return body if kind == wire.BYE else b"{}"
        return b"{}"

    def error(self, kind: str, message: str) -> RunError:
        """Return an error of this stack, with the last lines of its output."""
        self._pump(lambda: False, 0.0)
        output = self._log.tail(TAIL_BYTES).decode(errors="replace")
        return RunError(kind, f"stack {self._name}: {message}", output_tail(output), by_stack=True)

    def release(self) -> None:
        """Let the launcher end the stack and its descendants, without waiting for their end."""
        if self._control >= 0:
            with suppress(BrokenPipeError):
                os.write(self._control, b"\0")
            os.close(self._control)
            self._control = -1

    def close(self) -> None:
        """Call `release`, wait until the stack and its descendants have ended, and free all resources."""
        self.release()
        self._pump(lambda: self._output not in self._readers and self._report not in self._readers, CLEANUP_TIMEOUT_S)
        self._launcher.kill()
        self._launcher.wait()
        for descriptor in (self._report, self._output):
            os.close(descriptor)
        self._stream.close()
        self._log.close()

    def _crash_error(self) -> RunError:
        """Return the error of a stack that has disconnected, with its exit code if it exits soon."""
        self._pump(lambda: bool(self._exit_message) or self._report not in self._readers, EXIT_TIMEOUT_S)
        launcher_runs = self._report in self._readers
        reason = "its process has closed its socket, but still runs" if launcher_runs else "its launcher has ended"
        return self.error(protocol.CRASHED, self._exit_message or reason)

    def _pump(self, is_done: Callable[[], bool], limit_s: float) -> None:
        """Transfer frames and output until `is_done` returns True or `limit_s` seconds have passed."""
        end = time.monotonic() + limit_s
        while not is_done():
            remaining = end - time.monotonic()
            for descriptor, events in self._poll.poll(max(0.0, remaining) * 1e3):
                if events & select.POLLOUT:
                    self._flush()
                if events & ~select.POLLOUT and not self._readers[descriptor]():
                    self._poll.unregister(descriptor)  # the other side has closed it
                    del self._readers[descriptor]
            if remaining <= 0:
                return

    def _flush(self) -> None:
        try:
            while self._send_buffer and not self._is_disconnected:
                del self._send_buffer[: self._stream.send(self._send_buffer[:READ_BYTES])]
        except BlockingIOError:
            pass
        except OSError:  # the stack closed the socket; its last frames can still be read
            self._send_buffer.clear()
        if self._stream.fileno() in self._readers:
            self._poll.modify(self._stream, select.POLLIN | (select.POLLOUT if self._send_buffer else 0))

    def _read_frames(self) -> bool:
        try:
            data = self._stream.recv(READ_BYTES)
        except ConnectionResetError:
            data = b""
        self._receive_buffer += data
        self._is_disconnected = not data
        return bool(data)

    def _read_exit_report(self) -> bool:
        data = os.read(self._report, READ_BYTES)
        self._report_buffer += data
        *lines, rest = self._report_buffer.split(b"\n")
        self._report_buffer = bytearray(rest)
        for line in lines:
            self._exit_message = _describe_exit(json.loads(line))
        return bool(data)

    def _read_output(self) -> bool:
        data = os.read(self._output, READ_BYTES)
        self._log.append(data)
        return bool(data)

    def _has_frame(self) -> bool:
        received = len(self._receive_buffer)
        return received >= wire.SIZE.size and received >= wire.SIZE.size + self._frame_size()

    def _frame_size(self) -> int:
        """Return the size of the next frame in bytes. Raises RunError if it is invalid."""
        (size,) = wire.SIZE.unpack_from(self._receive_buffer)
        if not 1 <= size <= wire.MAX_FRAME_BYTES:
            raise self.error(
                protocol.PROTOCOL, f"a frame of {size} bytes; the protocol allows 1 to {wire.MAX_FRAME_BYTES}"
            )
        return int(size)

    def _pop_frame(self) -> tuple[int, bytes]:
        end = wire.SIZE.size + self._frame_size()
        kind, body = self._receive_buffer[wire.SIZE.size], bytes(self._receive_buffer[wire.SIZE.size + 1 : end])
        del self._receive_buffer[:end]
        return kind, body


def _describe_exit(report: dict[str, Any]) -> str:
    """Return a message for a report of the launcher: the stack could not be started, or has exited."""
    if "failed" in report:
        return f"its process cannot be started: {report['failed']}"
    code = report["exit"]
    return f"its process was killed ({signal_name(-code)})" if code < 0 else f"its process exited {code}"


def _error_message(body: bytes) -> str:
    try:
        return str(wire.from_json(body)["message"])[:MAX_MESSAGE_LENGTH]
    except (wire.Malformed, KeyError):
        return "it reported an error without a message"
