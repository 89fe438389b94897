"""Captured output of a process: a log file of limited size, and the parts of it that error messages quote."""

import os
import re
import signal
from pathlib import Path, PurePath

MAX_HEAD_BYTES = 1 << 20
MAX_TAIL_BYTES = 1 << 18
"""Sizes of the first and the last part of a process's output that CappedLog keeps."""
READ_BYTES = 1 << 20
"""Maximum number of bytes that are read from a pipe at once."""
TAIL_BYTES = 16_384
"""Maximum number of bytes of output in a message about the end of a process."""


class CappedLog:
    """Log file with the first MAX_HEAD_BYTES and the last MAX_TAIL_BYTES of the output of a process.

    Writes no file if `path` is None or cannot be written.
    """

    def __init__(self, path: Path | None) -> None:
        self._head_bytes_left, self._omitted_bytes = MAX_HEAD_BYTES, 0
        self._tail = bytearray()  # the last MAX_TAIL_BYTES of the output
        self._unwritten_bytes = 0  # of the tail: bytes that are not yet in the file
        self._file: int | None = None
        if path is None:
            return
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
        except OSError:
            self._head_bytes_left = 0  # the run reports the unusable folder itself

    def append(self, data: bytes) -> None:
        """Append output of the process."""
        head = data[: self._head_bytes_left]
        self._head_bytes_left -= len(head)
        self._write(head)
        self._unwritten_bytes += len(data) - len(head)
        self._tail += data
        if len(self._tail) > MAX_TAIL_BYTES:
            del self._tail[:-MAX_TAIL_BYTES]
        self._omitted_bytes += max(0, self._unwritten_bytes - MAX_TAIL_BYTES)
        self._unwritten_bytes = min(self._unwritten_bytes, MAX_TAIL_BYTES)

    def tail(self, size: int) -> bytes:
        """Return at most the last `size` bytes of the output."""
        return bytes(self._tail[-size:])

    def close(self) -> None:
        """Write the remaining output to the file."""
        if self._omitted_bytes:
            self._write(f"\n… simscen omitted {self._omitted_bytes} bytes here …\n".encode())
        if self._unwritten_bytes:
            self._write(bytes(self._tail[-self._unwritten_bytes :]))
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _write(self, data: bytes) -> None:
        if self._file is None or not data:
            return
        try:
            os.write(self._file, data)
        except OSError:  # no space left: the run reports it for its own files
            os.close(self._file)
            self._file = None


def signal_name(number: int) -> str:
    """Return the name of a signal, such as "SIGKILL"; "signal 40" for a real-time signal without a name."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


TAIL_LINES = 20
"""Number of lines of output that an error message quotes."""
_DUMP_HEADER = re.compile(r"^(Current thread|Thread|Stack) .*\(most recent call first\):$", re.MULTILINE)
_DUMP_FRAME = re.compile(r'^  File "(?P<file>.*)", line (?P<line>\d+) in (?P<name>\S+)$', re.MULTILINE)
"""Header and frames of a traceback of faulthandler."""


def innermost_frame(output: str) -> str:
    """Return the innermost call of a faulthandler traceback in the output, such as "step (simulation.py:88)", or ""."""
    heads = list(_DUMP_HEADER.finditer(output))
    frame = _DUMP_FRAME.search(output, heads[-1].end()) if heads else None
    return f"{frame['name']} ({PurePath(frame['file']).name}:{frame['line']})" if frame else ""


def output_tail(output: str) -> str:
    """Return TAIL_LINES lines of the output: the start of a faulthandler traceback if there is one, else the end."""
    heads = list(_DUMP_HEADER.finditer(output))
    if heads:
        before = output[: heads[-1].start()].splitlines()[-3:]
        return "\n".join([*before, *output[heads[-1].start() :].splitlines()[: TAIL_LINES - len(before)]])
    return "\n".join(output.splitlines()[-TAIL_LINES:])
