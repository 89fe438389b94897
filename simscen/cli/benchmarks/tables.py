"""Text tables that fit the width of the terminal."""

from collections.abc import Callable, Sequence

from simscen.report.display_text import StyledText, plain_text, wrap_line

TableRow = Sequence[str]
"""Cells of a row: its name, then its numbers."""
Adjust = Callable[[str, int], str]
"""Function that pads a cell to a width, such as str.rjust."""


def fits(lines: Sequence[str], columns: int | None) -> bool:
    """Return whether no line is longer than `columns`; None stands for unlimited width."""
    return columns is None or max(map(len, lines)) <= columns


def align_columns(table: Sequence[TableRow], adjust: Adjust = str.rjust) -> list[str]:
    """Return one line per row with aligned cells: the first cell left-aligned, the others with `adjust`."""
    widths = column_widths(table)
    return [
        "  ".join((row[0].ljust(widths[0]), *map(adjust, row[1:], widths[1:]))).rstrip()
        for row in table
    ]  # fmt: skip


def stack_rows(table: Sequence[TableRow], columns: int) -> list[str]:
    """Return two lines per row: its name, and below it its numbers, aligned."""
    widths = column_widths(table)[1:]
    gap = "  " if 2 + sum(widths) + 2 * (len(widths) - 1) <= columns else " "
    return [line for name, *rest in table for line in (name, "  " + gap.join(map(str.rjust, rest, widths)))]


def label_cells(head: TableRow, row: TableRow, columns: int) -> list[str]:
    """Return the lines of one row: its name, then each number with its heading, as many per line as fit."""
    pieces = tuple(StyledText(f"  {name} {cell}") for name, cell in zip(head[1:], row[1:], strict=True))
    return [row[0], *(plain_text(line) for line in wrap_line(pieces, columns))]


def wrap_lines(lines: Sequence[str], columns: int | None) -> list[str]:
    """Return the lines, wrapped between words if they are too long."""
    return [plain_text(piece) for line in lines for piece in wrap_line((StyledText(line),), columns)]


def column_widths(table: Sequence[TableRow]) -> list[int]:
    """Return the widths of the columns of a table."""
    return [max(map(len, cells)) for cells in zip(*table, strict=True)]
