"""The table of `simscen bench nav`, for people and for machines."""

import json
from collections.abc import Sequence
from dataclasses import asdict

from simscen.cli.bench_columns import aligned, broken, fits, named, stacked
from simscen.cli.bench_run import Localized, Measured
from simscen.study.barn import DWA
from simscen.study.tally import Row
from simscen.study.versus import Difference, Versus

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


def as_text(rows: Sequence[Measured], pairs: Sequence[Versus] = (), columns: int | None = None) -> str:
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


def as_json(rows: Sequence[Measured], pairs: Sequence[Versus] = ()) -> str:
    """All numbers, and DWA's."""
    told = {"experiments": [asdict(row) for row in rows], "dwa_published": DWA}
    return json.dumps({**told, "versus": [asdict(pair) for pair in pairs]} if pairs else told, indent=2)


def _versus(pairs: Sequence[Versus], columns: int | None) -> list[str]:
    """A line for each pair of experiments, or where that is too long each number with what it is."""
    changes = [_changes(pair) for pair in pairs]
    lines = aligned([VERSUS, *changes])
    if columns is None or fits(lines, columns):
        return lines
    return [VERSUS[0], *(line for row in changes for line in named(VERSUS, row, columns))]


def _changes(pair: Versus) -> tuple[str, ...]:
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
