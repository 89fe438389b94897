"""Output of `simscen bench nav` as text and as JSON."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from simscen.bench.navigation.barn import PUBLISHED_DWA_RESULTS
from simscen.bench.navigation.summary import Difference, ExperimentComparison, ExperimentSummary
from simscen.cli.benchmarks.navigation_runs import ExperimentResult, LocalizationAccuracy
from simscen.cli.benchmarks.tables import align_columns, fits, label_cells, two_line_rows, wrap_lines

PUBLISHED_DWA_LINE = "published results of BARN for DWA at 0.5 m/s, in another simulator and 50 worlds: " + ", ".join(
    f"{name} {value:.3f}" for name, value in PUBLISHED_DWA_RESULTS.items()
)
COMPARISON_HEAD = ("with minus without --stack", "pairs", "better", "worse", "success", "seconds", "SCT", "score")
"""Column headings of the comparison. SCT is success weighted by completion time, and score is the BARN score."""
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
"""Column headings of the results. `failed` includes errors."""


def as_text(
    rows: Sequence[ExperimentResult], comparisons: Sequence[ExperimentComparison] = (), columns: int | None = None
) -> str:
    """Return the table of results, the localization accuracy, the comparisons, and the published figures of BARN.

    `comparisons` has the comparison of each experiment without --stack and with --stack. `columns` is the width of the
    terminal in characters; None stands for unlimited width.
    """
    table = [TABLE_HEAD, *(_cells(result.tally) for result in rows)]
    lines = align_columns(table)
    if columns is not None and not fits(lines, columns):
        lines = two_line_rows(table, columns)
    for result in rows:
        if result.localized is not None:
            lines += ["", *_localization_lines(result.tally.case, result.localized)]
    if comparisons:
        lines += ["", *_comparison_lines(comparisons, columns)]
    if any(result.tally.case.startswith("BARN") for result in rows):
        lines += ["", PUBLISHED_DWA_LINE]
    return "\n".join(wrap_lines(lines, columns))


def as_json(rows: Sequence[ExperimentResult], comparisons: Sequence[ExperimentComparison] = ()) -> str:
    """Return results, comparisons, and the published figures of BARN as JSON."""
    data: dict[str, Any] = {
        "experiments": [asdict(row) for row in rows],
        "dwa_published": PUBLISHED_DWA_RESULTS,
    }
    if comparisons:
        data["versus"] = [asdict(comparison) for comparison in comparisons]
    return json.dumps(data, indent=2)


def _comparison_lines(comparisons: Sequence[ExperimentComparison], columns: int | None) -> list[str]:
    """Return a table with one line per comparison; if it is too wide, lines of cells with their headings instead."""
    table = [_comparison_cells(comparison) for comparison in comparisons]
    lines = align_columns([COMPARISON_HEAD, *table])
    if columns is None or fits(lines, columns):
        return lines
    return [COMPARISON_HEAD[0], *(line for row in table for line in label_cells(COMPARISON_HEAD, row, columns))]


def _comparison_cells(comparison: ExperimentComparison) -> tuple[str, ...]:
    """Return the cells of one comparison in the columns of COMPARISON_HEAD."""
    differences = (
        _difference_text(comparison.success, ".3f"),
        _difference_text(comparison.seconds, ".1f"),
        _difference_text(comparison.sct, ".3f"),
        _difference_text(comparison.score, ".3f"),
    )
    return comparison.case, f"{comparison.pairs}", f"{comparison.better}", f"{comparison.worse}", *differences


def _difference_text(difference: Difference | None, number_format: str) -> str:
    if difference is None:
        return "-"
    mean, *bounds = (f"{value:+{number_format}}" for value in (difference.mean, *(difference.interval or ())))
    return f"{mean} ({' … '.join(bounds)})" if bounds else mean


def _cells(row: ExperimentSummary) -> tuple[str, ...]:
    """Return the cells of one experiment in the columns of TABLE_HEAD."""
    interval = row.success_interval
    return (
        row.case,
        f"{row.runs}",
        f"{row.success:.3f}",
        "-" if interval is None else f"{interval[0]:.3f} … {interval[1]:.3f}",
        f"{row.collisions:.3f}",
        f"{row.timeouts:.3f}",
        f"{row.failed + row.errors:.3f}",
        _value_text(row.seconds, ".1f", " s"),
        _value_text(row.path_ratio, ".2f"),
        _value_text(row.sct, ".3f"),
        _value_text(row.score, ".3f"),
    )


def _value_text(value: float | None, number_format: str, unit: str = "") -> str:
    return "-" if value is None else f"{value:{number_format}}{unit}"


def _localization_lines(experiment: str, localized: LocalizationAccuracy) -> list[str]:
    errors = (
        f"{_value_text(localized.rmse, '.3f', ' m')} RMSE, worst run {_value_text(localized.worst_rmse, '.3f', ' m')}"
    )
    lines = [f"{experiment}: {errors}"]
    if localized.anees:
        anees = ", ".join(f"{value:.2f} at {seconds:g} s" for seconds, value in localized.anees.items())
        intervals = [f"{low:.2f} … {high:.2f}" for low, high in localized.bounds.values()]
        if len(set(intervals)) == 1:
            label = f"95 % interval of a consistent localizer: {intervals[0]}"
        else:  # some runs ended before the last time
            label = f"95 % intervals of a consistent localizer: {', '.join(intervals)}"
        lines.append(f"  ANEES {anees}; {label}")
    return lines
