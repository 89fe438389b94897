"""Read a text file that somebody else wrote, without trusting it."""

import errno
import os
import re
import stat
from pathlib import Path

from simscen.core.problems import Problem

LARGEST_FILE = 1 << 20

# C0 and C1 controls, lone surrogates, bidirectional overrides (they make text read other than it is, CVE-2021-42574)
# and the line breaks that only YAML 1.1 knows, so that a line here is a line in every editor.
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufffe\uffff]")


def read_text(path: Path, shown: str) -> str | Problem:
    """The text of a regular file of at most 1 MiB in UTF-8, line breaks as \\n; or what is wrong with it.

    `shown` is how problems name the file. A FIFO, device, socket or folder is refused without being read.
    """
    try:
        raw = _read_bytes(path)
    except OSError as error:
        return Problem(shown, 0, 0, "SC001", reason(error))
    if isinstance(raw, str):
        return Problem(shown, 0, 0, "SC001", raw)
    return _decode(raw, shown)


def reason(error: OSError) -> str:
    """Why a file could not be opened, in plain words."""
    known = {
        errno.ENOENT: "no such file or directory",
        errno.EACCES: "permission denied",
        errno.ELOOP: "symbolic link loop",
        errno.ENAMETOOLONG: "the name is too long",
        errno.ENOTDIR: "a part of the path is not a folder",
        errno.EISDIR: "not a regular file",
    }
    return known.get(error.errno or 0, os.strerror(error.errno) if error.errno else "cannot be read")


def _read_bytes(path: Path) -> bytes | str:
    if not stat.S_ISREG(path.stat().st_mode):
        return "not a regular file"
    # Between stat and open the file may have become a FIFO: O_NONBLOCK keeps the open from waiting for a writer.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            return "not a regular file"
        raw = file.read(LARGEST_FILE + 1)
    return raw if len(raw) <= LARGEST_FILE else "larger than 1 MiB"


def _decode(raw: bytes, shown: str) -> str | Problem:
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = _plain_breaks(raw[: error.start].decode("utf-8-sig", errors="replace"))
        line, column = _position(before, len(before))
        hint = "save the file as UTF-8" + (" (it looks like UTF-16)" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "")
        return Problem(shown, line, column, "SC002", f"not valid UTF-8 at byte {error.start}", hint)
    text = _plain_breaks(text)
    if control := _CONTROL.search(text):
        line, column = _position(text, control.start())
        message = f"control character U+{ord(control[0]):04X}"
        return Problem(shown, line, column, "SC002", message, "remove it; in text, write an escape such as \\n")
    return text


def _plain_breaks(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _position(text: str, index: int) -> tuple[int, int]:
    line = text.count("\n", 0, index) + 1
    return line, index - (text.rfind("\n", 0, index) + 1) + 1
