"""Reads text files safely, and adds source lines to problems."""

import errno
import os
import re
import stat
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from simscen.core.errors import Problem

MAX_FILE_BYTES = 1 << 20
"""Maximum size of a text file: 1 MiB."""
_IMAGE_START = re.compile(rb"P[25]\s+[#\d]|\x89PNG|BM.{4}\0{4}|\xff\xd8\xff", re.DOTALL)
"""First bytes of images in the formats PGM, PNG, BMP, and JPEG."""

# C0 and C1 controls, noncharacters, bidirectional overrides (CVE-2021-42574), and the line breaks of YAML 1.1 that
# editors do not treat as line breaks.
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufffe\uffff]")


def read_text(path: Path, display_name: str) -> str | Problem:
    """Return the text of a regular UTF-8 file of at most 1 MiB without control characters, or a problem."""
    raw = read_bytes(path, display_name)
    return raw if isinstance(raw, Problem) else decode(raw, display_name)


def read_bytes(path: Path, display_name: str) -> bytes | Problem:
    """Return the content of a regular file of at most 1 MiB that is not an image, or a problem."""
    try:
        raw = _read_bytes(path)
    except OSError as error:
        return Problem(display_name, 0, 0, "SC001", os_error_reason(error))
    return Problem(display_name, 0, 0, "SC001", raw) if isinstance(raw, str) else raw


def decode(raw: bytes, display_name: str) -> str | Problem:
    """Return the text of the bytes in a file, or the problem of a wrong encoding or a control character."""
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = _normalize_line_breaks(raw[: error.start].decode("utf-8-sig", errors="replace"))
        line, column = _position(before, len(before))
        hint = "save the file as UTF-8" + (" (it looks like UTF-16)" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "")
        return Problem(display_name, line, column, "SC002", f"not valid UTF-8 at byte {error.start}", hint)
    text = _normalize_line_breaks(text)
    if control := _CONTROL.search(text):
        line, column = _position(text, control.start())
        message = f"control character U+{ord(control[0]):04X}"
        return Problem(display_name, line, column, "SC002", message, "remove it, or write an escape such as \\n")
    return text


def with_source_line(problem: Problem, texts: Mapping[str, str]) -> Problem:
    """Return a copy of a problem with the text of the line. `texts` are the texts of files, by path as in messages."""
    lines = texts.get(problem.path, "").split("\n")
    return replace(problem, source=lines[problem.line - 1]) if 0 < problem.line <= len(lines) else problem


def os_error_reason(error: OSError) -> str:
    """Return the reason for an error for messages, such as "permission denied"."""
    known = {
        errno.ENOENT: "no such file or directory",
        errno.EACCES: "permission denied",
        errno.ELOOP: "symbolic link loop",
        errno.ENAMETOOLONG: "the name is too long",
        errno.ENOTDIR: "part of the path is not a folder",
        errno.EISDIR: "not a regular file",
    }
    return known.get(error.errno or 0, os.strerror(error.errno) if error.errno else "cannot be read")


def _read_bytes(path: Path) -> bytes | str:
    """Return the content of a file, or the reason why it is rejected. Raises OSError if it cannot be read."""
    if not stat.S_ISREG(path.stat().st_mode):
        return "not a regular file"
    # Between stat and open the file may have become a FIFO: O_NONBLOCK keeps the open from waiting for a writer.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            return "not a regular file"
        raw = file.read(MAX_FILE_BYTES + 1)
    if _IMAGE_START.match(raw):
        return "an image, not a text; if it is the image of a map, name the YAML file of the map"
    return raw if len(raw) <= MAX_FILE_BYTES else "larger than 1 MiB"


def _normalize_line_breaks(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _position(text: str, index: int) -> tuple[int, int]:
    """Return the line and the column of the character at `index`, both from 1."""
    line = text.count("\n", 0, index) + 1
    return line, index - (text.rfind("\n", 0, index) + 1) + 1
