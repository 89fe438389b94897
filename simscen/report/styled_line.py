"""A line of text, piece by piece with the role of each piece."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from shutil import get_terminal_size
from typing import Literal, TextIO

from simscen.report.display_text import display_width

Role = Literal["plain", "name", "good", "bad", "odd", "quiet"]


@dataclass(frozen=True)
class StyledText:
    """Text of one role; a reporter chooses how the role looks.

    `file` is what a terminal that can opens when the text is clicked; a `shell` command goes on in the next line only
    in a way that a shell understands.
    """

    text: str
    role: Role = "plain"
    file: str = ""
    shell: bool = False


StyledLine = tuple[StyledText, ...]


def plain_text(line: StyledLine) -> str:
    """The line without its roles."""
    return "".join(piece.text for piece in line).rstrip()


_WORD = re.compile(r"(\s*)(\S+)")
_SHELL_WORD = re.compile(r"""(\s*)((?:'[^']*'|"[^"]*"|\\.|[^\s'"\\])+)""", re.DOTALL)
_LINE_CONTINUATION = " \\"


def wrap_line(line: StyledLine, columns: int | None) -> list[StyledLine]:
    """The line as lines of at most `columns`, those after the first set in; None = as it is.

    What stands in a column of its own, behind two blanks or more, begins a new line before it is broken. A word that
    is longer than a line stays whole: a path that is cut could not be copied.
    """
    if columns is None or display_width(plain_text(line)) <= columns:
        return [line]
    return _LineWrapper(columns, min(_indent(line), columns // 3)).lines(line)


def _indent(line: StyledLine) -> int:
    """Where the text of a line begins that has a label before it; of any other, two columns behind its beginning."""
    first = line[0].text
    if first.strip() and first.endswith(" "):
        return display_width(first)
    text = plain_text(line)
    return len(text) - len(text.lstrip()) + 2


class _LineWrapper:
    def __init__(self, columns: int, indent: int) -> None:
        self._columns, self._indent = columns, indent
        self._lines: list[StyledLine] = []
        self._line: list[StyledText] = []
        self._used = 0

    def lines(self, line: StyledLine) -> list[StyledLine]:
        for number, piece in enumerate(line):
            glued = number + 1 < len(line) and re.match(r"[^\s\w]+", line[number + 1].text)
            self._piece(piece, display_width(glued[0]) if glued else 0)
        self._end()
        return self._lines

    def _piece(self, piece: StyledText, glued: int) -> None:
        """`glued` columns have to be left for what follows without a blank between."""
        text = piece.text
        if self._used + display_width(text.rstrip()) + glued <= self._columns:
            self._put(piece, text)
        elif text.startswith("  ") and self._indent + display_width(text.strip()) + glued <= self._columns:
            self._next(piece, text.strip())
        else:
            for blank, word, last in _words(piece):
                tail = glued if last else len(_LINE_CONTINUATION) if piece.shell else 0
                if self._used + display_width(blank + word) + tail <= self._columns or not self._used:
                    self._put(piece, blank + word)
                else:
                    self._next(piece, word, tail)

    def _put(self, piece: StyledText, text: str) -> None:
        self._line.append(replace(piece, text=text))
        self._used += display_width(text)

    def _next(self, piece: StyledText, text: str, tail: int = 0) -> None:
        """Go on in the next line; what is too long for its place there begins further to the left."""
        if piece.shell and self._line and self._line[-1].shell:
            self._put(piece, _LINE_CONTINUATION)
        indent = max(0, min(self._indent, self._columns - display_width(text) - tail))
        self._end()
        self._line.append(StyledText(" " * indent))
        self._used = indent
        self._put(piece, text)

    def _end(self) -> None:
        self._lines.append(tuple(self._line))
        self._line = []


def _words(piece: StyledText) -> Iterator[tuple[str, str, bool]]:
    """Each word with the blanks before it, and whether it is the last."""
    found = (_SHELL_WORD if piece.shell else _WORD).findall(piece.text)
    for number, (blank, word) in enumerate(found, start=1):
        yield blank, word, number == len(found)


@dataclass(frozen=True)
class TerminalStyle:
    """Whether to write in `color`, with `live` progress below the lines, and as if for a `terminal`."""

    color: bool
    live: bool
    terminal: bool

    @property
    def columns(self) -> int | None:
        """How wide the terminal is now; None = lines are as long as they are, for programs and for searching."""
        return get_terminal_size().columns if self.terminal else None


def detect_style(out: TextIO, environ: Mapping[str, str]) -> TerminalStyle:
    """What suits `out`. NO_COLOR wins over FORCE_COLOR and CLICOLOR_FORCE, these over TERM=dumb and CLICOLOR=0."""
    terminal = out.isatty()
    able = terminal and environ.get("TERM") not in ("dumb", "unknown")
    if environ.get("NO_COLOR"):
        color = False
    elif any(environ.get(name, "") not in ("", "0") for name in ("FORCE_COLOR", "CLICOLOR_FORCE")):
        color = True
    else:
        color = able and environ.get("CLICOLOR") != "0"
    return TerminalStyle(color and can_encode(out), able and can_encode(out), terminal)


def can_encode(out: TextIO) -> bool:
    """Whether `out` takes the signs that we use; others get ASCII, and nothing that moves a cursor."""
    try:
        "✓✗·≤≥°".encode(getattr(out, "encoding", None) or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True
