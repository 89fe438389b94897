"""Lines of text with roles such as "good" and "bad", wrapping of lines, and detection of terminal features."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from shutil import get_terminal_size
from typing import Literal, TextIO

from simscen.report.display_text import display_width

Role = Literal["plain", "name", "good", "bad", "warning", "quiet"]


@dataclass(frozen=True)
class StyledText:
    """Text with a role. The reporter chooses the style of the role.

    `file` is the target of a link in terminals with support for links. If `shell` is true, the text is a shell command,
    and wrapped lines end with a backslash.
    """

    text: str
    role: Role = "plain"
    file: str = ""
    shell: bool = False


StyledLine = tuple[StyledText, ...]


def plain_text(line: StyledLine) -> str:
    """Return the text of a line."""
    return "".join(piece.text for piece in line).rstrip()


_WORD = re.compile(r"(\s*)(\S+)")
_SHELL_WORD = re.compile(r"""(\s*)((?:'[^']*'|"[^"]*"|\\.|[^\s'"\\])+)""", re.DOTALL)
_LINE_CONTINUATION = " \\"


def wrap_line(line: StyledLine, columns: int | None) -> list[StyledLine]:
    """Wrap a line to at most `columns` (None = no limit). Further lines are indented.

    Text after two or more spaces moves to a new line before it is wrapped itself. Words that are longer than a line are
    not split, so that paths can be copied.
    """
    if columns is None or display_width(plain_text(line)) <= columns:
        return [line]
    return _LineWrapper(columns, min(_indent(line), columns // 3)).lines(line)


def _indent(line: StyledLine) -> int:
    """Return the column of the text after a label; without a label, two columns after the start of the line."""
    first = line[0].text
    if first.strip() and first.endswith(" "):
        return display_width(first)
    text = plain_text(line)
    return len(text) - len(text.lstrip()) + 2


class _LineWrapper:
    """Wraps one line."""

    def __init__(self, columns: int, indent: int) -> None:
        self._columns, self._indent = columns, indent
        self._lines: list[StyledLine] = []
        self._line: list[StyledText] = []
        self._used_columns = 0

    def lines(self, line: StyledLine) -> list[StyledLine]:
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
                tail = reserved if last else len(_LINE_CONTINUATION) if piece.shell else 0
                if self._used_columns + display_width(blank + word) + tail <= self._columns or not self._used_columns:
                    self._append(piece, blank + word)
                else:
                    self._start_line(piece, word, tail)

    def _append(self, piece: StyledText, text: str) -> None:
        self._line.append(replace(piece, text=text))
        self._used_columns += display_width(text)

    def _start_line(self, piece: StyledText, text: str, tail: int = 0) -> None:
        """Continue in the next line. Text that is too long for the indentation starts further to the left."""
        if piece.shell and self._line and self._line[-1].shell:
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
    """Yield each word with the spaces before it, and whether it is the last one."""
    found = (_SHELL_WORD if piece.shell else _WORD).findall(piece.text)
    for number, (blank, word) in enumerate(found, start=1):
        yield blank, word, number == len(found)


@dataclass(frozen=True)
class TerminalStyle:
    """Whether to use `color` and `live` progress, and whether the output is a `terminal`."""

    color: bool
    live: bool
    terminal: bool

    @property
    def columns(self) -> int | None:
        """Current width of the terminal, or None if the output is not a terminal and lines are not wrapped."""
        return get_terminal_size().columns if self.terminal else None


def detect_style(out: TextIO, environ: Mapping[str, str]) -> TerminalStyle:
    """Detect the features of `out`.

    NO_COLOR takes precedence over FORCE_COLOR and CLICOLOR_FORCE, and these over TERM=dumb and CLICOLOR=0.
    """
    terminal = out.isatty()
    is_capable = terminal and environ.get("TERM") not in ("dumb", "unknown")
    if environ.get("NO_COLOR"):
        color = False
    elif any(environ.get(name, "") not in ("", "0") for name in ("FORCE_COLOR", "CLICOLOR_FORCE")):
        color = True
    else:
        color = is_capable and environ.get("CLICOLOR") != "0"
    return TerminalStyle(color and can_encode(out), is_capable and can_encode(out), terminal)


def can_encode(out: TextIO) -> bool:
    """Return whether `out` can encode the symbols of the reporters. Otherwise, ASCII and no live progress are used."""
    try:
        "✓✗·≤≥°".encode(getattr(out, "encoding", None) or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True
