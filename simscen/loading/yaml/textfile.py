"""Read a text file that somebody else wrote, without trusting it."""

import errno
import os
import re
import stat
from pathlib import Path

from simscen.core.errors import Problem

MAX_FILE_BYTES = 1 << 20

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
        return Problem(shown, 0, 0, "SC001", os_error_reason(error))
    if isinstance(raw, str):
        return Problem(shown, 0, 0, "SC001", raw)
    return _decode(raw, shown)


def os_error_reason(error: OSError) -> str:
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
        raw = file.read(MAX_FILE_BYTES + 1)
    return raw if len(raw) <= MAX_FILE_BYTES else "larger than 1 MiB"


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


_SPACE = "a plain space"
LOOKALIKES = {
    "\u00a0": ("no-break space", _SPACE),
    "\u2007": ("figure space", _SPACE),
    "\u202f": ("narrow no-break space", _SPACE),
    "\u3000": ("ideographic space", _SPACE),
    "\u201c": ("typographic quote", '`"`'),
    "\u201d": ("typographic quote", '`"`'),
    "\u201e": ("typographic quote", '`"`'),
    "\u2018": ("typographic quote", "`'`"),
    "\u2019": ("typographic quote", "`'`"),
    "\uff1a": ("full-width colon", "`:`"),
    "\uff0c": ("full-width comma", "`,`"),
    "\u2013": ("dash", "`-`"),
    "\u2014": ("dash", "`-`"),
    "\u2212": ("minus sign", "`-`"),
}
"""Character → what it is called, and what is meant."""


def find_lookalike(text: str) -> int | None:
    """Where the first of them is in a text; None for none."""
    return next((index for index, character in enumerate(text) if character in LOOKALIKES), None)


def describe_lookalike(character: str) -> str:
    """What it is: "no-break space (U+00A0)"."""
    return f"{LOOKALIKES[character][0]} (U+{ord(character):04X})"


def lookalike_hint(text: str) -> str:
    """What to write instead of the first one of a text; "" where there is none."""
    index = find_lookalike(text)
    if index is None:
        return ""
    article = "an" if LOOKALIKES[text[index]][0][0] in "aeiou" else "a"
    return f"there is {article} {describe_lookalike(text[index])} in it: write {LOOKALIKES[text[index]][1]}"
