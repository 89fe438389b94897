"""Output of `simscen bench nav` as text, fitted to the width of the terminal, and as JSON."""

import json
from collections.abc import Sequence
from dataclasses import asdict

from simscen.bench.navigation.barn import PUBLISHED_DWA_RESULTS
from simscen.bench.navigation.summary import Difference, DriveComparison, ExperimentSummary
from simscen.cli.benchmarks.navigation_runs import ExperimentResult, LocalizationAccuracy
from simscen.cli.benchmarks.tables import align_columns, fits, label_cells, stack_rows, wrap_lines

PUBLISHED_DWA_LINE = "BARN's own figures for DWA at 0.5 m/s, in another simulator and all 50 worlds: " + ", ".join(
    f"{name} {value:.3f}" for name, value in PUBLISHED_DWA_RESULTS.items()
)
COMPARISON_HEAD = ("with minus without --stack", "pairs", "better", "worse", "success", "seconds", "SCT", "score")
"""Columns of the comparison. SCT is success weighted by completion time, and score is the BARN score."""
TABLE_HEAD = (
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


def as_text(rows: Sequence[ExperimentResult], pairs: Sequence[DriveComparison] = (), columns: int | None = None) -> str:
    """Return the table of results, then the effect of --stack on each pair of experiments, then published figures.

    If a line would be longer than `columns`, each experiment has one line for its name and one for its numbers. None
    stands for unlimited width.
    """
    table = [TABLE_HEAD, *(_cells(result.tally) for result in rows)]
    lines = align_columns(table)
    if columns is not None and not fits(lines, columns):
        lines = stack_rows(table, columns)
    for result in rows:
        if result.localized is not None:
            lines += ["", *_localization_lines(result.tally.case, result.localized)]
    if pairs:
        lines += ["", *_comparison_lines(pairs, columns)]
    if any(result.tally.case.startswith("BARN") for result in rows):
        lines += ["", PUBLISHED_DWA_LINE]
    return "\n".join(wrap_lines(lines, columns))


def as_json(rows: Sequence[ExperimentResult], pairs: Sequence[DriveComparison] = ()) -> str:
    """Return all numbers as JSON, with the published figures of DWA."""
    data = {"experiments": [asdict(row) for row in rows], "dwa_published": PUBLISHED_DWA_RESULTS}
    return json.dumps({**data, "versus": [asdict(pair) for pair in pairs]} if pairs else data, indent=2)


def _comparison_lines(pairs: Sequence[DriveComparison], columns: int | None) -> list[str]:
    """Return one line per pair of experiments, or labeled numbers if such lines are too long."""
    changes = [_changes(pair) for pair in pairs]
    lines = align_columns([COMPARISON_HEAD, *changes])
    if columns is None or fits(lines, columns):
        return lines
    return [COMPARISON_HEAD[0], *(line for row in changes for line in label_cells(COMPARISON_HEAD, row, columns))]


def _changes(pair: DriveComparison) -> tuple[str, ...]:
    """Return the cells of a row that compares the same drives with the parameters of --stack and without."""
    forms = ((pair.success, ".3f"), (pair.seconds, ".1f"), (pair.sct, ".3f"), (pair.score, ".3f"))
    changes = (_change(difference, form) for difference, form in forms)
    return (pair.case, f"{pair.pairs}", f"{pair.better}", f"{pair.worse}", *changes)


def _change(difference: Difference | None, form: str) -> str:
    if difference is None:
        return "-"
    if difference.interval is None:
        return f"{difference.mean:+{form}}"
    return f"{difference.mean:+{form}} ({difference.interval[0]:+{form}} … {difference.interval[1]:+{form}})"


def _cells(row: ExperimentSummary) -> tuple[str, ...]:
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


def _localization_lines(experiment: str, localized: LocalizationAccuracy) -> list[str]:
    low, high = localized.bounds
    moments = ", ".join(f"{value:.2f} at {seconds:g} s" for seconds, value in localized.anees.items())
    errors = f"{_or_none(localized.rmse, '.3f', ' m')} RMSE, worst run {_or_none(localized.worst_rmse, '.3f', ' m')}"
    return [f"{experiment}: {errors}", f"  ANEES {moments}; a consistent belief lies in {low:.2f} … {high:.2f} (95 %)"]
