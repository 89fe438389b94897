"""Text from users and workers, made safe to show: what could move a cursor or lie about order becomes visible."""

import os
import re
import unicodedata
from pathlib import Path

_UNSAFE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
_MARKER = re.compile(r"##(\w*)\[")
_ASCII = str.maketrans(
    {"✓": "+", "✗": "x", "·": "-", "≤": "<=", "≥": ">=", "°": " deg", "×": "x", "…": "...", "—": "-"}
)


def escape_control(text: str) -> str:
    """Control, bidirectional and lone surrogate characters as escapes; tabs and newlines stay.

    What remains may stand in XML 1.0 as it is.
    """
    return _UNSAFE.sub(lambda match: _escaped(match[0]), text)


def one_line(text: str) -> str:
    """The same on one line."""
    return escape_control(" ".join(text.split()))


def shell_command_text(text: str) -> str:
    """A command of shlex.join on one line, to be pasted: its spaces stay, and what would break the line is quoted.

    Line breaks and tabs stand between single quotes there; bash and zsh read `$'…'`.
    """
    return escape_control(text.replace("\n", "'$'\\n''").replace("\t", "'$'\\t''"))


def display_width(text: str) -> int:
    """How many columns of a terminal the text takes."""
    return sum(0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


def ascii_only(text: str) -> str:
    """For terminals that know nothing else: our own signs have stand-ins, the rest becomes escapes."""
    return text.translate(_ASCII).encode("ascii", "backslashreplace").decode("ascii")


def escape_ci_commands(line: str) -> str:
    """A line of output that no CI takes for one of its commands, such as `::error::` at its start on GitHub."""
    return re.sub(r"^(\s*):(?=:)", r"\1\\x3a", escape_ci_markers(line))


def escape_ci_markers(text: str) -> str:
    """Text without what CI obeys anywhere in a line: `##[error]` (GitHub, Azure), `##vso[…]`, `##teamcity[…]`."""
    return _MARKER.sub(r"##\1\\[", text)


def escape_ci_markers_in_json(document: str) -> str:
    """The same for a JSON document, whose content stays as it is."""
    return document.replace("##", "#\\u0023")


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"


def relative_to_checkout(file: str) -> str:
    """`file`, as seen from the working folder, relative to $GITHUB_WORKSPACE; as it is where it is not in there.

    GitHub places annotations by the top of the repository that it checked out, wherever the command was called.
    """
    workspace = os.environ.get("GITHUB_WORKSPACE")
    if not workspace:
        return file
    top, real = Path(os.path.realpath(workspace)), Path(os.path.realpath(file))
    return real.relative_to(top).as_posix() if real.is_relative_to(top) and os.path.lexists(real) else file


def relative_to_cwd(file: str, folder: str) -> str:
    """`file`, as seen from `folder`, as seen from the working folder; as it is where it has gone since."""
    there = str(Path(folder, file))
    return min(os.path.relpath(there), there, key=len) if file and folder and os.path.lexists(there) else file
