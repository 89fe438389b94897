"""Text for terminals, XML, HTML, and CI logs: escaping, paths, and lines with styled parts."""

import os
import re
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path, PurePath
from shutil import get_terminal_size
from typing import Literal, TextIO

_UNSAFE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
_MARKER = re.compile(r"##(\w*)\[")
_ASCII = str.maketrans(
    {"✓": "+", "✗": "x", "·": "-", "≤": "<=", "≥": ">=", "°": " deg", "×": "x", "…": "...", "—": "-", "→": "->"}
)


def relative_path(path: str, folder: str) -> str:
    """Return a path relative to `folder`, or the path itself if it is outside of the folder."""
    is_inside = folder and PurePath(path).is_relative_to(folder)
    return PurePath(path).relative_to(folder).as_posix() if is_inside else PurePath(path).as_posix()


def escape_control(text: str) -> str:
    """Replace control characters, bidirectional marks, and lone surrogates by escapes. Keep tabs and newlines.

    The result is valid in XML 1.0.
    """
    return _UNSAFE.sub(lambda match: _escaped(match[0]), text)


def one_line(text: str) -> str:
    """Escape control characters, and replace all white space by single spaces."""
    return escape_control(" ".join(text.split()))


def html_text(text: str) -> str:
    """Escape text for one line of HTML, also for attributes in double quotes."""
    return escape(one_line(text), quote=True)


def number_with_noun(number: int, noun: str) -> str:
    """Return a number with a regular noun: "1 run", "2 runs"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def shell_command_text(text: str) -> str:
    """Return a command, quoted by shlex.join, on one line that can be copied into bash or zsh.

    Line breaks and tabs, which are in single quotes, become `$'\\n'` and `$'\\t'`.
    """
    return escape_control(text.replace("\n", "'$'\\n''").replace("\t", "'$'\\t''"))


def display_width(text: str) -> int:
    """Return the number of terminal columns of a text: two for a wide character, none for a combining one."""
    return sum(0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


def ascii_only(text: str) -> str:
    """Return a text in ASCII: simscen's symbols are replaced by similar text, other non-ASCII characters by escapes."""
    return text.translate(_ASCII).encode("ascii", "backslashreplace").decode("ascii")


def escape_ci_commands(line: str) -> str:
    """Escape a line of output so that no CI system reads it as a command, such as `::error::` on GitHub."""
    return re.sub(r"^(\s*):(?=:)", r"\1\\x3a", escape_ci_markers(line))


def escape_ci_markers(text: str) -> str:
    """Escape CI commands that can be anywhere in a line: `##[error]` (GitHub, Azure), `##vso[…]`, `##teamcity[…]`."""
    return _MARKER.sub(r"##\1\\[", text)


def escape_ci_markers_in_json(document: str) -> str:
    """Escape CI commands in the text of a JSON document, so that a parser still reads the same data."""
    return document.replace("##", "#\\u0023")


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"


def relative_to_checkout(file: str) -> str:
    """Convert a path relative to the working folder to a path relative to $GITHUB_WORKSPACE.

    GitHub expects the paths of annotations in this form. Outside of GitHub Actions, and for a file that does not exist
    or is outside of that folder, return the path unchanged.
    """
    workspace = os.environ.get("GITHUB_WORKSPACE")
    if not workspace:
        return file
    top, target = Path(os.path.realpath(workspace)), Path(os.path.realpath(file))
    return target.relative_to(top).as_posix() if target.is_relative_to(top) and os.path.lexists(target) else file


def relative_to_cwd(file: str, folder: str) -> str:
    """Return the path of a `file` in `folder` as seen from the working folder; the absolute path if that is shorter.

    `file` is relative to `folder`, which is absolute. Return `file` unchanged if it no longer exists, or if one of the
    arguments is "".
    """
    path = str(Path(folder, file))
    return min(os.path.relpath(path), path, key=len) if file and folder and os.path.lexists(path) else file


Role = Literal["plain", "name", "good", "bad", "warning", "quiet"]
"""Meaning of a text, from which a reporter chooses its color and weight."""


@dataclass(frozen=True)
class StyledText:
    """Part of a line with a role.

    `file` is the path that the text links to in terminals with support for links; "" for no link. If `is_shell` is
    true, the text is a shell command, and a backslash continues it in the next line when it is wrapped.
    """

    text: str
    role: Role = "plain"
    file: str = ""
    is_shell: bool = False


StyledLine = tuple[StyledText, ...]
"""Parts of a line of console output, from left to right; () is an empty line."""


def plain_text(line: StyledLine) -> str:
    """Return the text of a line without styles and trailing spaces."""
    return "".join(piece.text for piece in line).rstrip()


_WORD = re.compile(r"(\s*)(\S+)")
_SHELL_WORD = re.compile(r"""(\s*)((?:'[^']*'|"[^"]*"|\\.|[^\s'"\\])+)""", re.DOTALL)
_LINE_CONTINUATION = " \\"


def wrap_line(line: StyledLine, columns: int | None) -> list[StyledLine]:
    """Wrap a line to at most `columns` (None = no limit), and indent the second and further lines.

    A part that begins with two spaces moves to the next line as a whole if it fits there. Words that are longer than a
    line are not split, so that paths can be copied.
    """
    if columns is None or display_width(plain_text(line)) <= columns:
        return [line]
    return _LineWrapper(columns, min(_indent(line), columns // 3)).wrap(line)


def _indent(line: StyledLine) -> int:
    """Return the indentation for the further lines of a wrapped line: the column after its label.

    A label is a first part that ends with a space, such as "      again ". For a line without a label, return two
    columns more than the indentation of the line.
    """
    first = line[0].text
    if first.strip() and first.endswith(" "):
        return display_width(first)
    text = plain_text(line)
    return len(text) - len(text.lstrip()) + 2


class _LineWrapper:
    """Wraps one line to at most `columns`; further lines start at column `indent`. Use each instance only once."""

    def __init__(self, columns: int, indent: int) -> None:
        self._columns, self._indent = columns, indent
        self._lines: list[StyledLine] = []
        self._line: list[StyledText] = []
        self._used_columns = 0

    def wrap(self, line: StyledLine) -> list[StyledLine]:
        for number, piece in enumerate(line):
            punctuation = number + 1 < len(line) and re.match(r"[^\s\w]+", line[number + 1].text)
            self._add_piece(piece, display_width(punctuation[0]) if punctuation else 0)
        self._finish_line()
        return self._lines

    def _add_piece(self, piece: StyledText, reserved: int) -> None:
        """Add a piece, and keep `reserved` columns for the punctuation that follows it."""
        text = piece.text
        if self._used_columns + display_width(text.rstrip()) + reserved <= self._columns:
            self._append(piece, text)
        elif text.startswith("  ") and self._indent + display_width(text.strip()) + reserved <= self._columns:
            self._start_line(piece, text.strip())
        else:
            for blank, word, last in _words(piece):
                tail = reserved if last else len(_LINE_CONTINUATION) if piece.is_shell else 0
                if self._used_columns + display_width(blank + word) + tail <= self._columns or not self._used_columns:
                    self._append(piece, blank + word)
                else:
                    self._start_line(piece, word, tail)

    def _append(self, piece: StyledText, text: str) -> None:
        self._line.append(replace(piece, text=text))
        self._used_columns += display_width(text)

    def _start_line(self, piece: StyledText, text: str, tail: int = 0) -> None:
        """Continue in the next line, and keep `tail` columns after the text.

        If the text does not fit, the indentation is reduced by as many columns as are missing.
        """
        if piece.is_shell and self._line and self._line[-1].is_shell:
            self._append(piece, _LINE_CONTINUATION)
        indent = max(0, min(self._indent, self._columns - display_width(text) - tail))
        self._finish_line()
        self._line.append(StyledText(" " * indent))
        self._used_columns = indent
        self._append(piece, text)

    def _finish_line(self) -> None:
        self._lines.append(tuple(self._line))
        self._line = []


def _words(piece: StyledText) -> Iterator[tuple[str, str, bool]]:
    """Yield for each word: the spaces before it, the word, and whether it is the last one."""
    found = (_SHELL_WORD if piece.is_shell else _WORD).findall(piece.text)
    for number, (blank, word) in enumerate(found, start=1):
        yield blank, word, number == len(found)


@dataclass(frozen=True)
class TerminalStyle:
    """Features of an output stream. With live progress, lines on the screen are updated in place."""

    has_color: bool
    has_live_progress: bool
    is_terminal: bool

    @property
    def columns(self) -> int | None:
        """Current width of the terminal, or None if the output is not a terminal and lines are not wrapped."""
        return get_terminal_size().columns if self.is_terminal else None


def detect_style(out: TextIO, environ: Mapping[str, str]) -> TerminalStyle:
    """Detect the features of `out` from the stream and from the environment variables `environ`.

    NO_COLOR takes precedence over FORCE_COLOR and CLICOLOR_FORCE, which take precedence over TERM=dumb and CLICOLOR=0.
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
    """Return whether `out` can encode the symbols of the reporters, such as "✓". If not, reporters write ASCII."""
    try:
        "✓✗·≤≥°".encode(getattr(out, "encoding", None) or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True
