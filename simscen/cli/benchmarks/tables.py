"""Layouts of text tables: aligned columns, and narrower layouts for narrow terminals."""

from collections.abc import Callable, Sequence

from simscen.report.display_text import StyledText, plain_text, wrap_line

TableRow = Sequence[str]
"""Cells of a row. The first cell is the name of the row."""
PadFunction = Callable[[str, int], str]
"""Function that pads a cell to a width, such as str.rjust."""


def fits(lines: Sequence[str], columns: int | None) -> bool:
    """Return whether all lines have at most `columns` characters; None stands for unlimited width."""
    return columns is None or max(map(len, lines)) <= columns


def align_columns(table: Sequence[TableRow], pad: PadFunction = str.rjust) -> list[str]:
    """Return one line per row with aligned columns: the first one left-aligned, the others padded by `pad`."""
    widths = _column_widths(table)
    return ["  ".join((row[0].ljust(widths[0]), *map(pad, row[1:], widths[1:]))).rstrip() for row in table]


def table_lines(head: TableRow, rows: Sequence[TableRow], columns: int | None) -> list[str]:
    """Return a table with left-aligned columns; if it is too wide, the lines of `label_cells` for each row."""
    lines = align_columns([head, *rows], str.ljust)
    if fits(lines, columns) or columns is None:
        return lines
    return [line for row in rows for line in label_cells(head, row, columns)]


def two_line_rows(table: Sequence[TableRow], columns: int) -> list[str]:
    """Return two lines per row, the name of the row and the other cells, for a terminal with `columns` characters."""
    widths = _column_widths(table)[1:]
    gap = "  " if 2 + sum(widths) + 2 * (len(widths) - 1) <= columns else " "
    return [line for name, *cells in table for line in (name, "  " + gap.join(map(str.rjust, cells, widths)))]


def label_cells(head: TableRow, row: TableRow, columns: int) -> list[str]:
    """Return the lines of one row: its name, and then the other cells, each after its heading from `head`.

    A line has as many cells as fit into `columns` characters.
    """
    pieces = tuple(StyledText(f"  {name} {cell}") for name, cell in zip(head[1:], row[1:], strict=True))
    return [row[0], *(plain_text(line) for line in wrap_line(pieces, columns))]


def wrap_lines(lines: Sequence[str], columns: int | None) -> list[str]:
    """Return the lines, wrapped between words at `columns` characters; None stands for unlimited width."""
    return [plain_text(piece) for line in lines for piece in wrap_line((StyledText(line),), columns)]


def _column_widths(table: Sequence[TableRow]) -> list[int]:
    return [max(map(len, cells)) for cells in zip(*table, strict=True)]
