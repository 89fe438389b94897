"""Tables of the commands of `simscen bench`, as wide as they are or as the terminal is."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict

from simscen.bench.navigation.barn import DWA
from simscen.bench.navigation.summary import Difference, DriveComparison, Row
from simscen.cli.benchmarks.navigation_runs import Localized, Measured
from simscen.report.styled_line import StyledText, plain_text, wrap_line

TableRow = Sequence[str]
Adjust = Callable[[str, int], str]


def fits(lines: Sequence[str], columns: int | None) -> bool:
    """Whether no line is longer than so many columns; None = as long as they are."""
    return columns is None or max(map(len, lines)) <= columns


def aligned(table: Sequence[TableRow], adjust: Adjust = str.rjust) -> list[str]:
    """A line for each row, its cells below those of the others; the first from the left, the rest as `adjust` says."""
    widths = widths_of(table)
    return [
        "  ".join((row[0].ljust(widths[0]), *map(adjust, row[1:], widths[1:]))).rstrip()
        for row in table
    ]  # fmt: skip


def stacked(table: Sequence[TableRow], columns: int) -> list[str]:
    """Two lines for each row: its name, and its numbers below those of the others."""
    widths = widths_of(table)[1:]
    gap = "  " if 2 + sum(widths) + 2 * (len(widths) - 1) <= columns else " "
    return [line for name, *rest in table for line in (name, "  " + gap.join(map(str.rjust, rest, widths)))]


def named(head: TableRow, row: TableRow, columns: int) -> list[str]:
    """The name of a row, then each of its numbers behind what it is, as many in a line as fit."""
    pieces = tuple(StyledText(f"  {name} {cell}") for name, cell in zip(head[1:], row[1:], strict=True))
    return [row[0], *(plain_text(line) for line in wrap_line(pieces, columns))]


def broken(lines: Sequence[str], columns: int | None) -> list[str]:
    """The lines, broken between words where they are too long."""
    return [plain_text(piece) for line in lines for piece in wrap_line((StyledText(line),), columns)]


def widths_of(table: Sequence[TableRow]) -> list[int]:
    """How wide the columns of a table are."""
    return [max(map(len, cells)) for cells in zip(*table, strict=True)]


PUBLISHED = "BARN's own figures for DWA at 0.5 m/s, in another simulator and all 50 worlds: " + ", ".join(
    f"{name} {value:.3f}" for name, value in DWA.items()
)
VERSUS = ("same drives, with and without", "pairs", "better", "worse", "success", "seconds", "SCT", "score")
HEAD = (
    "experiment",
    "runs",
    "success",
    "95 % interval",
    "collision",
    "timeout",
    "failed",
    "time",
    "path",
    "SCT",
    "score",
)


def as_text(rows: Sequence[Measured], pairs: Sequence[DriveComparison] = (), columns: int | None = None) -> str:
    """Aligned columns; what another stack changes; published figures of another simulator as a footnote.

    Where a line would be longer than so many `columns`, an experiment has one for its name and one for its numbers.
    """
    table = [HEAD, *(_cells(measured.tally) for measured in rows)]
    lines = aligned(table)
    if columns is not None and not fits(lines, columns):
        lines = stacked(table, columns)
    for measured in rows:
        if measured.localized is not None:
            lines += ["", *_belief(measured.tally.case, measured.localized)]
    if pairs:
        lines += ["", *_versus(pairs, columns)]
    if any(measured.tally.case.startswith("BARN") for measured in rows):
        lines += ["", PUBLISHED]
    return "\n".join(broken(lines, columns))


def as_json(rows: Sequence[Measured], pairs: Sequence[DriveComparison] = ()) -> str:
    """All numbers, and DWA's."""
    told = {"experiments": [asdict(row) for row in rows], "dwa_published": DWA}
    return json.dumps({**told, "versus": [asdict(pair) for pair in pairs]} if pairs else told, indent=2)


def _versus(pairs: Sequence[DriveComparison], columns: int | None) -> list[str]:
    """A line for each pair of experiments, or where that is too long each number with what it is."""
    changes = [_changes(pair) for pair in pairs]
    lines = aligned([VERSUS, *changes])
    if columns is None or fits(lines, columns):
        return lines
    return [VERSUS[0], *(line for row in changes for line in named(VERSUS, row, columns))]


def _changes(pair: DriveComparison) -> tuple[str, ...]:
    """What the other stack changes in the same drives, pair by pair."""
    forms = ((pair.success, ".3f"), (pair.seconds, ".1f"), (pair.sct, ".3f"), (pair.score, ".3f"))
    changes = (_change(difference, form) for difference, form in forms)
    return (pair.case, f"{pair.pairs}", f"{pair.better}", f"{pair.worse}", *changes)


def _change(difference: Difference | None, form: str) -> str:
    if difference is None:
        return "-"
    if difference.interval is None:
        return f"{difference.mean:+{form}}"
    return f"{difference.mean:+{form}} ({difference.interval[0]:+{form}} … {difference.interval[1]:+{form}})"


def _cells(row: Row) -> tuple[str, ...]:
    interval = row.success_interval
    return (
        row.case,
        f"{row.runs}",
        f"{row.success:.3f}",
        "-" if interval is None else f"{interval[0]:.3f} … {interval[1]:.3f}",
        f"{row.collisions:.3f}",
        f"{row.timeouts:.3f}",
        f"{row.failed + row.errors:.3f}",
        _or_none(row.seconds, ".1f", " s"),
        _or_none(row.path_ratio, ".2f"),
        _or_none(row.sct, ".3f"),
        _or_none(row.score, ".3f"),
    )


def _or_none(value: float | None, form: str, unit: str = "") -> str:
    return "-" if value is None else f"{value:{form}}{unit}"


def _belief(case: str, localized: Localized) -> list[str]:
    low, high = localized.bounds
    moments = ", ".join(f"{value:.2f} at {seconds:g} s" for seconds, value in localized.anees.items())
    errors = f"{_or_none(localized.rmse, '.3f', ' m')} RMSE, worst run {_or_none(localized.worst_rmse, '.3f', ' m')}"
    return [f"{case}: {errors}", f"  ANEES {moments}; a consistent belief lies in {low:.2f} … {high:.2f} (95 %)"]
