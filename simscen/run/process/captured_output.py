"""Capture the output of a process in a log of limited size, and find a Python stack dump in it."""

import os
import re
from pathlib import Path, PurePath

MAX_HEAD_BYTES = 1 << 20
MAX_TAIL_BYTES = 1 << 18
READ_BYTES = 1 << 20


class CappedLog:
    """Log file with the first MAX_HEAD_BYTES and the last MAX_TAIL_BYTES of the output of a process.

    Without a writable file, `last` still returns the end of the output.
    """

    def __init__(self, path: Path | None) -> None:
        self._room, self._left_out = MAX_HEAD_BYTES, 0
        self._end = bytearray()  # the last MAX_TAIL_BYTES of the output
        self._waiting = 0  # how many of these are not in the file yet
        self._file: int | None = None
        if path is None:
            return
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
        except OSError:
            self._room = 0  # the run reports the unusable folder itself

    def take(self, data: bytes) -> None:
        """Add output."""
        head = data[: self._room]
        self._room -= len(head)
        self._write(head)
        self._waiting += len(data) - len(head)
        self._end += data
        if len(self._end) > MAX_TAIL_BYTES:
            del self._end[:-MAX_TAIL_BYTES]
        self._left_out += max(0, self._waiting - MAX_TAIL_BYTES)
        self._waiting = min(self._waiting, MAX_TAIL_BYTES)

    def last(self, most: int) -> bytes:
        """Return the last bytes of the output."""
        return bytes(self._end[-most:])

    def close(self) -> None:
        """Write the remaining output to the file."""
        if self._left_out:
            self._write(f"\n… simscen left out {self._left_out} bytes here …\n".encode())
        if self._waiting:
            self._write(bytes(self._end[-self._waiting :]))
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


TAIL_LINES = 20
_HEAD = re.compile(r"^(Current thread|Thread|Stack) .*\(most recent call first\):$", re.MULTILINE)
_FRAME = re.compile(r'^  File "(?P<file>.*)", line (?P<line>\d+) in (?P<name>\S+)$', re.MULTILINE)


def innermost_frame(printed: str) -> str:
    """Return the innermost frame of a dumped stack, e.g. "step (simulation.py:88)"; "" without a dump."""
    heads = list(_HEAD.finditer(printed))
    frame = _FRAME.search(printed, heads[-1].end()) if heads else None
    return f"{frame['name']} ({PurePath(frame['file']).name}:{frame['line']})" if frame else ""


def output_tail(printed: str) -> str:
    """Return the last lines of the output, or the first lines of a dumped stack."""
    heads = list(_HEAD.finditer(printed))
    if heads:
        before = printed[: heads[-1].start()].splitlines()[-3:]
        return "\n".join([*before, *printed[heads[-1].start() :].splitlines()[: TAIL_LINES - len(before)]])
    return "\n".join(printed.splitlines()[-TAIL_LINES:])
