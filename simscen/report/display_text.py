"""Preparation of text for terminals, XML, HTML, and CI logs: escaping, paths, and wrapping of styled lines."""

import base64
import hashlib
import json
import os
import re
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path, PurePath
from shutil import get_terminal_size
from typing import Literal, TextIO

_CONTROL_CHARACTERS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
_NOT_ASCII = re.compile("[^\x00-\x7f]+")
_CI_MARKER = re.compile(r"##(\w*)\[")
"""Start of a CI command that is valid anywhere in a line."""
_ASCII_REPLACEMENTS = str.maketrans(
    {"✓": "+", "✗": "x", "·": "-", "≤": "<=", "≥": ">=", "°": " deg", "×": "x", "…": "...", "—": "-", "→": "->"}
)


def relative_path(path: str, folder: str) -> str:
    """Return a path relative to `folder`, or the unchanged path if it is outside of the folder."""
    is_inside = folder and PurePath(path).is_relative_to(folder)
    return PurePath(path).relative_to(folder).as_posix() if is_inside else PurePath(path).as_posix()


def escape_control(text: str) -> str:
    """Replace control characters, bidirectional marks, and lone surrogates by escapes. Keep tabs and newlines.

    The result contains only characters that XML 1.0 allows.
    """
    return _CONTROL_CHARACTERS.sub(
        lambda match: f"\\x{code:02x}" if (code := ord(match[0])) < 256 else f"\\u{code:04x}", text
    )


def one_line(text: str) -> str:
    """Escape control characters, and replace all white space by single spaces."""
    return escape_control(" ".join(text.split()))


def html_text(text: str) -> str:
    """Escape text for one line of HTML, also for attributes in double quotes."""
    return escape(one_line(text), quote=True)


def csp_hash(text: str) -> str:
    """Return the hash "sha256-…" that allows a script or style in a content security policy."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}"


def number_with_noun(number: int, noun: str) -> str:
    """Return a number with a regular noun: "1 run", "2 runs"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def shell_command_text(text: str) -> str:
    """Return a command from shlex.join on one line for bash or zsh: line breaks as `$'\\n'`, tabs as `$'\\t'`."""
    return escape_control(text.replace("\n", "'$'\\n''").replace("\t", "'$'\\t''"))


def display_width(text: str) -> int:
    """Return the number of terminal columns of a text: two per wide character, none per combining character."""
    return sum(0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


def ascii_only(text: str) -> str:
    """Return a text in ASCII. Symbols such as "✓" are replaced by similar text, other characters by escapes."""
    return text.translate(_ASCII_REPLACEMENTS).encode("ascii", "backslashreplace").decode("ascii")


def escape_ci_commands(line: str) -> str:
    """Escape a line of output so that no CI system reads it as a command, such as `::error::` on GitHub."""
    return re.sub(r"^(\s*):(?=:)", r"\1\\x3a", escape_ci_markers(line))


def escape_ci_markers(text: str) -> str:
    """Escape the CI commands that are valid anywhere in a line: `##[error]`, `##vso[…]`, `##teamcity[…]`."""
    return _CI_MARKER.sub(r"##\1\\[", text)


def encodable_json(document: str, out: TextIO) -> str:
    """Return a JSON document with escapes if `out` cannot encode it. The parsed data does not change."""
    try:
        document.encode(out.encoding or "utf-8")
    except UnicodeEncodeError:
        return _NOT_ASCII.sub(lambda match: json.dumps(match[0])[1:-1], document)
    return document


def escape_ci_markers_in_json(document: str) -> str:
    """Escape the CI commands in a JSON document. The parsed data does not change."""
    return document.replace("##", "#\\u0023")


def relative_to_checkout(file: str) -> str:
    """Convert a path relative to the working folder to a path relative to $GITHUB_WORKSPACE.

    Return the path unchanged if the variable is not set, or if the file does not exist or is outside of that folder.
    """
    workspace = os.environ.get("GITHUB_WORKSPACE")
    if not workspace:
        return file
    top, target = Path(os.path.realpath(workspace)), Path(os.path.realpath(file))
    return target.relative_to(top).as_posix() if target.is_relative_to(top) and os.path.lexists(target) else file


def relative_to_cwd(file: str, folder: str) -> str:
    """Convert a path relative to `folder` (absolute) to a path relative to the working folder.

    Return the absolute path if it is shorter. Return `file` unchanged if the file does not exist, or if an argument is
    "".
    """
    path = str(Path(folder, file))
    return min(os.path.relpath(path), path, key=len) if file and folder and os.path.lexists(path) else file


Role = Literal["plain", "name", "good", "bad", "warning", "quiet"]
"""Meaning of a text. The reporter chooses the color and weight of the text by its role."""


@dataclass(frozen=True)
class StyledText:
    """Part of a line with a role.

    `file` is the path that the text links to; "" for no link. `is_shell` marks a shell command. If the command is
    wrapped, each line except the last ends with a backslash.
    """

    text: str
    role: Role = "plain"
    file: str = ""
    is_shell: bool = False


StyledLine = tuple[StyledText, ...]
"""Parts of a line of console output, from left to right; () is an empty line."""


def plain_text(line: StyledLine) -> str:
    """Return the text of a line without styles and trailing spaces."""
    return "".join(part.text for part in line).rstrip()


_WORD = re.compile(r"(\s*)(\S+)")
_SHELL_WORD = re.compile(r"""(\s*)((?:'[^']*'|"[^"]*"|\\.|[^\s'"\\])+)""", re.DOTALL)
_LINE_CONTINUATION = " \\"


def wrap_line(line: StyledLine, columns: int | None) -> list[StyledLine]:
    """Wrap a line to at most `columns` (None: no limit), and indent the second and further lines.

    A part that begins with two spaces moves to the next line as a whole if it fits there. Words are never split.
    """
    if columns is None or display_width(plain_text(line)) <= columns:
        return [line]
    return _LineWrapper(columns, min(_continuation_indent(line), columns // 3)).wrap(line)


def _continuation_indent(line: StyledLine) -> int:
    """Return the indentation of the second and further lines of a wrapped line.

    If the first part is a label that ends with a space, such as "      again ", return the width of the label.
    Otherwise, return the indentation of the first line plus two columns.
    """
    first = line[0].text
    if first.strip() and first.endswith(" "):
        return display_width(first)
    text = plain_text(line)
    return len(text) - len(text.lstrip()) + 2


class _LineWrapper:
    """Wraps one line to at most `columns`. Further lines start at column `indent`. Use each instance only once."""

    def __init__(self, columns: int, indent: int) -> None:
        self._columns, self._indent = columns, indent
        self._lines: list[StyledLine] = []
        self._line: list[StyledText] = []
        self._used_columns = 0

    def wrap(self, line: StyledLine) -> list[StyledLine]:
        """Return the wrapped lines."""
        for number, part in enumerate(line):
            punctuation = number + 1 < len(line) and re.match(r"[^\s\w]+", line[number + 1].text)
            self._add_part(part, display_width(punctuation[0]) if punctuation else 0)
        self._finish_line()
        return self._lines

    def _add_part(self, part: StyledText, reserved: int) -> None:
        """Add a part to the current line or the next one. Keep `reserved` columns free after it for punctuation."""
        text = part.text
        if self._used_columns + display_width(text.rstrip()) + reserved <= self._columns:
            self._append(part, text)
        elif text.startswith("  ") and self._indent + display_width(text.strip()) + reserved <= self._columns:
            self._start_line(part, text.strip())
        else:
            for blank, word, is_last in _words(part):
                free = reserved if is_last else len(_LINE_CONTINUATION) if part.is_shell else 0
                if self._used_columns + display_width(blank + word) + free <= self._columns or not self._used_columns:
                    self._append(part, blank + word)
                else:
                    self._start_line(part, word, free)

    def _append(self, part: StyledText, text: str) -> None:
        """Append `text` in the style of `part` to the current line."""
        self._line.append(replace(part, text=text))
        self._used_columns += display_width(text)

    def _start_line(self, part: StyledText, text: str, reserved: int = 0) -> None:
        """Start the next line with `text` in the style of `part`. Keep `reserved` columns free after the text.

        If the text does not fit, the indentation is reduced.
        """
        if part.is_shell and self._line and self._line[-1].is_shell:
            self._append(part, _LINE_CONTINUATION)
        indent = max(0, min(self._indent, self._columns - display_width(text) - reserved))
        self._finish_line()
        self._line.append(StyledText(" " * indent))
        self._used_columns = indent
        self._append(part, text)

    def _finish_line(self) -> None:
        self._lines.append(tuple(self._line))
        self._line = []


def _words(part: StyledText) -> Iterator[tuple[str, str, bool]]:
    """Yield (spaces before the word, word, True if it is the last word) for each word of a part."""
    words = (_SHELL_WORD if part.is_shell else _WORD).findall(part.text)
    for number, (blank, word) in enumerate(words, start=1):
        yield blank, word, number == len(words)


@dataclass(frozen=True)
class TerminalStyle:
    """Features of an output stream. Live progress means that lines on the screen are updated in place."""

    has_color: bool
    has_live_progress: bool
    is_terminal: bool

    @property
    def columns(self) -> int | None:
        """Current width of the terminal; None if the output is not a terminal."""
        return get_terminal_size().columns if self.is_terminal else None


def detect_style(out: TextIO, environ: Mapping[str, str]) -> TerminalStyle:
    """Detect the features of `out` from the stream and from the environment variables `environ`.

    Color depends on the first of these variables that is set: NO_COLOR, FORCE_COLOR or CLICOLOR_FORCE, TERM=dumb,
    CLICOLOR=0.
    """
    is_terminal = out.isatty()
    is_capable = is_terminal and environ.get("TERM") not in ("dumb", "unknown")
    if environ.get("NO_COLOR"):
        has_color = False
    elif any(environ.get(name, "") not in ("", "0") for name in ("FORCE_COLOR", "CLICOLOR_FORCE")):
        has_color = True
    else:
        has_color = is_capable and environ.get("CLICOLOR") != "0"
    return TerminalStyle(has_color and can_encode(out), is_capable and can_encode(out), is_terminal)


def can_encode(out: TextIO) -> bool:
    """Return whether `out` can encode the symbols of the reporters, such as "✓"."""
    try:
        "✓✗·≤≥°".encode(getattr(out, "encoding", None) or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True
