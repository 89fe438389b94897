"""Escaping of text from users and workers for terminals, XML, and CI logs, and display of file paths."""

import os
import re
import unicodedata
from pathlib import Path

_UNSAFE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
_MARKER = re.compile(r"##(\w*)\[")
_ASCII = str.maketrans(
    {"✓": "+", "✗": "x", "·": "-", "≤": "<=", "≥": ">=", "°": " deg", "×": "x", "…": "...", "—": "-", "→": "->"}
)


def escape_control(text: str) -> str:
    """Replace control, bidirectional and lone surrogate characters by escapes. Keep tabs and newlines.

    The result is valid in XML 1.0.
    """
    return _UNSAFE.sub(lambda match: _escaped(match[0]), text)


def one_line(text: str) -> str:
    """Escape control characters, and replace all white space by single spaces."""
    return escape_control(" ".join(text.split()))


def shell_command_text(text: str) -> str:
    """Return a command of shlex.join on one line, to be copied into bash or zsh.

    Line breaks and tabs, which shlex.join puts into single quotes, become `$'…'`.
    """
    return escape_control(text.replace("\n", "'$'\\n''").replace("\t", "'$'\\t''"))


def display_width(text: str) -> int:
    """Return the number of terminal columns of a text."""
    return sum(0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


def ascii_only(text: str) -> str:
    """Return ASCII for terminals without Unicode: replacements for simscen's symbols, escapes for the rest."""
    return text.translate(_ASCII).encode("ascii", "backslashreplace").decode("ascii")


def escape_ci_commands(line: str) -> str:
    """Escape a line of output so that no CI system reads it as a command, such as `::error::` on GitHub."""
    return re.sub(r"^(\s*):(?=:)", r"\1\\x3a", escape_ci_markers(line))


def escape_ci_markers(text: str) -> str:
    """Escape CI commands that can be anywhere in a line: `##[error]` (GitHub, Azure), `##vso[…]`, `##teamcity[…]`."""
    return _MARKER.sub(r"##\1\\[", text)


def escape_ci_markers_in_json(document: str) -> str:
    """Escape CI commands in a JSON document without changing its content."""
    return document.replace("##", "#\\u0023")


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"


def relative_to_checkout(file: str) -> str:
    """Convert a path relative to the working folder to one relative to $GITHUB_WORKSPACE, if the file is in there.

    GitHub expects paths of annotations to be relative to the top of the repository.
    """
    workspace = os.environ.get("GITHUB_WORKSPACE")
    if not workspace:
        return file
    top, target = Path(os.path.realpath(workspace)), Path(os.path.realpath(file))
    return target.relative_to(top).as_posix() if target.is_relative_to(top) and os.path.lexists(target) else file


def relative_to_cwd(file: str, folder: str) -> str:
    """Convert a path relative to `folder` to one relative to the working folder, if the file still exists."""
    path = str(Path(folder, file))
    return min(os.path.relpath(path), path, key=len) if file and folder and os.path.lexists(path) else file
