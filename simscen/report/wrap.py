"""Lines that fit a terminal: broken between words, so that what is read and copied stays whole."""

import re
from collections.abc import Iterator
from dataclasses import replace

from simscen.report.line import Line, Piece, text_of
from simscen.report.text import width

_WORD = re.compile(r"(\s*)(\S+)")
_SHELL_WORD = re.compile(r"""(\s*)((?:'[^']*'|"[^"]*"|\\.|[^\s'"\\])+)""", re.DOTALL)
_GOES_ON = " \\"


def wrapped(line: Line, columns: int | None) -> list[Line]:
    """The line as lines of at most `columns`, those after the first set in; None = as it is.

    What stands in a column of its own, behind two blanks or more, begins a new line before it is broken. A word that
    is longer than a line stays whole: a path that is cut could not be copied.
    """
    if columns is None or width(text_of(line)) <= columns:
        return [line]
    return _Wrapping(columns, min(_indent(line), columns // 3)).lines(line)


def _indent(line: Line) -> int:
    """Where the text of a line begins that has a label before it; of any other, two columns behind its beginning."""
    first = line[0].text
    if first.strip() and first.endswith(" "):
        return width(first)
    text = text_of(line)
    return len(text) - len(text.lstrip()) + 2


class _Wrapping:
    def __init__(self, columns: int, indent: int) -> None:
        self._columns, self._indent = columns, indent
        self._lines: list[Line] = []
        self._line: list[Piece] = []
        self._used = 0

    def lines(self, line: Line) -> list[Line]:
        for number, piece in enumerate(line):
            glued = number + 1 < len(line) and re.match(r"[^\s\w]+", line[number + 1].text)
            self._piece(piece, width(glued[0]) if glued else 0)
        self._end()
        return self._lines

    def _piece(self, piece: Piece, glued: int) -> None:
        """`glued` columns have to be left for what follows without a blank between."""
        text = piece.text
        if self._used + width(text.rstrip()) + glued <= self._columns:
            self._put(piece, text)
        elif text.startswith("  ") and self._indent + width(text.strip()) + glued <= self._columns:
            self._next(piece, text.strip())
        else:
            for blank, word, last in _words(piece):
                tail = glued if last else len(_GOES_ON) if piece.shell else 0
                if self._used + width(blank + word) + tail <= self._columns or not self._used:
                    self._put(piece, blank + word)
                else:
                    self._next(piece, word, tail)

    def _put(self, piece: Piece, text: str) -> None:
        self._line.append(replace(piece, text=text))
        self._used += width(text)

    def _next(self, piece: Piece, text: str, tail: int = 0) -> None:
        """Go on in the next line; what is too long for its place there begins further to the left."""
        if piece.shell and self._line and self._line[-1].shell:
            self._put(piece, _GOES_ON)
        indent = max(0, min(self._indent, self._columns - width(text) - tail))
        self._end()
        self._line.append(Piece(" " * indent))
        self._used = indent
        self._put(piece, text)

    def _end(self) -> None:
        self._lines.append(tuple(self._line))
        self._line = []


def _words(piece: Piece) -> Iterator[tuple[str, str, bool]]:
    """Each word with the blanks before it, and whether it is the last."""
    found = (_SHELL_WORD if piece.shell else _WORD).findall(piece.text)
    for number, (blank, word) in enumerate(found, start=1):
        yield blank, word, number == len(found)
