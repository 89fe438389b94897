"""Tables of the commands of `simscen bench`, as wide as they are or as the terminal is."""

from collections.abc import Callable, Sequence

from simscen.report.line import Piece, text_of
from simscen.report.wrap import wrapped

Row = Sequence[str]
Adjust = Callable[[str, int], str]


def fits(lines: Sequence[str], columns: int | None) -> bool:
    """Whether no line is longer than so many columns; None = as long as they are."""
    return columns is None or max(map(len, lines)) <= columns


def aligned(table: Sequence[Row], adjust: Adjust = str.rjust) -> list[str]:
    """A line for each row, its cells below those of the others; the first from the left, the rest as `adjust` says."""
    widths = widths_of(table)
    return [
        "  ".join((row[0].ljust(widths[0]), *map(adjust, row[1:], widths[1:]))).rstrip()
        for row in table
    ]  # fmt: skip


def stacked(table: Sequence[Row], columns: int) -> list[str]:
    """Two lines for each row: its name, and its numbers below those of the others."""
    widths = widths_of(table)[1:]
    gap = "  " if 2 + sum(widths) + 2 * (len(widths) - 1) <= columns else " "
    return [line for name, *rest in table for line in (name, "  " + gap.join(map(str.rjust, rest, widths)))]


def named(head: Row, row: Row, columns: int) -> list[str]:
    """The name of a row, then each of its numbers behind what it is, as many in a line as fit."""
    pieces = tuple(Piece(f"  {name} {cell}") for name, cell in zip(head[1:], row[1:], strict=True))
    return [row[0], *(text_of(line) for line in wrapped(pieces, columns))]


def broken(lines: Sequence[str], columns: int | None) -> list[str]:
    """The lines, broken between words where they are too long."""
    return [text_of(piece) for line in lines for piece in wrapped((Piece(line),), columns)]


def widths_of(table: Sequence[Row]) -> list[int]:
    """How wide the columns of a table are."""
    return [max(map(len, cells)) for cells in zip(*table, strict=True)]
