"""Text from users and workers, made safe to show: what could move a cursor or lie about order becomes visible."""

import re

_UNSAFE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
_ASCII = str.maketrans(
    {"✓": "+", "✗": "x", "·": "-", "≤": "<=", "≥": ">=", "°": " deg", "×": "x", "…": "...", "—": "-"}
)


def visible(text: str) -> str:
    """Control, bidirectional and lone surrogate characters as escapes; tabs and newlines stay.

    What remains may stand in XML 1.0 as it is.
    """
    return _UNSAFE.sub(lambda match: _escaped(match[0]), text)


def one_line(text: str) -> str:
    """The same on one line."""
    return visible(" ".join(text.split()))


def ascii_only(text: str) -> str:
    """For terminals that know nothing else: our own signs have stand-ins, the rest becomes escapes."""
    return text.translate(_ASCII).encode("ascii", "backslashreplace").decode("ascii")


def no_command(line: str) -> str:
    """A line of output that no CI takes for one of its commands (`::error::` on GitHub, `##[error]` on Azure)."""
    defused = line.replace("##[", "#\\x23[")
    return re.sub(r"^(\s*):(?=:)", r"\1\\x3a", defused)


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"
