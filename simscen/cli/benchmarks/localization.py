"""Command `simscen bench localization`, which measures the accuracy of AMCL."""

import json
import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.cli.benchmarks.results import FormatOption, print_progress
from simscen.cli.benchmarks.tables import table_lines, wrap_lines
from simscen.cli.diagnostics import print_text
from simscen.cli.shared_options import TextOrJson
from simscen.core.errors import NothingSelected, UsageError
from simscen.loading.schema.messages import quoted
from simscen.report.display_text import detect_style

if TYPE_CHECKING:
    from simscen.bench.localization.campaign import ParameterSetResults, SuccessRate, Trial
    from simscen.bench.localization.consistency import Consistency
    from simscen.bench.localization.sparse_logs import SparseTrial


def command(
    buildings: Annotated[int, typer.Option(min=1, max=1000, help="Number of generated buildings.")] = 10,
    first: Annotated[int, typer.Option(min=1, max=1_000_000, help="Number of the first building.")] = 1,
    only: Annotated[
        list[str] | None,
        typer.Option(help="Select sets of parameters by a part of their name; repeatable. Not with --sparse."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", "-j", min=1, max=256, help="Number of parallel processes; default: one per core."),
    ] = None,
    sparse: Annotated[
        bool, typer.Option("--sparse", help="Use logs with scans 1 m or 0.5 rad apart, with five seeds each.")
    ] = False,
    format_: FormatOption = TextOrJson.TEXT,
) -> None:
    """Measure the accuracy of AMCL on generated logs.

    The buildings are asymmetric office floors of 40 m and more with people, moved furniture, and glass. The robot has a
    lidar of 181 or 361 beams over 180° and wheels that slip. Each building has eleven logs: five with a known start;
    two without people and with the furniture of the map, one of them also without slip; one with an unknown start; one
    in which half of the floor was rebuilt after mapping; one with a map of only half of the floor; and one of a
    kidnapped robot. Each log is evaluated with several sets of parameters, including Nav2's and simscen's defaults.
    Confidence intervals are computed by bootstrap over buildings. Lost robots are listed on standard error. Takes a
    few minutes on two cores.

    With --sparse, variants of AMCL are compared on logs with scans 1 m or 0.5 rad apart, as in many public data sets.
    The table has a row for each kind of log and a column for each variant. Each cell shows the number of lost runs, the
    median error, and the error at the end. --only cannot be used.
    """
    from simscen.bench.localization.campaign import PARAMETER_SETS, run_buildings, summarize

    numbers = range(first, first + buildings)
    workers = workers or len(os.sched_getaffinity(0))
    if sparse:
        _measure_sparse_logs(numbers, workers, only, format_)
        return
    names = [name for name in PARAMETER_SETS if not only or any(part.casefold() in name.casefold() for part in only)]
    if not names:
        raise NothingSelected(
            "no set of parameters matches --only; available: " + ", ".join(map(quoted, PARAMETER_SETS))
        )
    trials: dict[str, list[Trial]] = {name: [] for name in names}
    for done, building_trials in enumerate(run_buildings(numbers, names, min(buildings, workers)), 1):
        for name, new in building_trials.items():
            trials[name] += new
            _print_failures(name, new)
        print_progress(f"{done} of {buildings} buildings" if done < buildings else "")
    rows = [summarize(name, set_trials) for name, set_trials in trials.items()]
    if format_ is TextOrJson.JSON:
        logs = {name: [asdict(trial) for trial in set_trials] for name, set_trials in trials.items()}
        print(json.dumps({"rows": [asdict(row) for row in rows], "logs": logs}, indent=2))
    else:
        print_text(as_text(rows, detect_style(sys.stdout, os.environ).columns))


def _measure_sparse_logs(numbers: range, workers: int, only: list[str] | None, format_: TextOrJson) -> None:
    from simscen.bench.localization.sparse_logs import run_sparse_logs, sparse_table

    if only:
        raise UsageError("--sparse compares all variants of AMCL; remove --only")
    trials: list[SparseTrial] = []
    for new in run_sparse_logs(numbers, workers):
        trials += new
        print_progress(f"{new[0].kind}, building {new[0].building}")
    print_progress("")
    if format_ is TextOrJson.JSON:
        print(json.dumps({"logs": [asdict(trial) for trial in trials]}, indent=2))
    else:
        head, *rows = sparse_table(trials)
        lines = table_lines(head, rows, detect_style(sys.stdout, os.environ).columns)
        print_text("\n".join(["lost runs, median error, error at the end", *lines]))


def _print_failures(name: str, trials: "Sequence[Trial]") -> None:
    """Print each unsuccessful trial to stderr. `name` is the name of the parameter set."""
    for trial in trials:
        if not trial.succeeded:
            log = f"building {trial.building}, log {trial.number}, {trial.circumstance}"
            print_progress("")
            found = "not localized" if trial.found is None else f"localized after {trial.found:.1f} s"
            print_text(f"{name}: {log}: error up to {trial.largest:.1f} m, {found}", sys.stderr)


COLUMN_NAMES = {
    "tracked": "tracked", "unknown": "start unknown", "outdated": "half rebuilt", "half": "half a map",
    "kidnapped": "kidnapped",
}  # fmt: skip
"""Column headings of the table by circumstance. Other circumstances only count for the consistency."""


def as_text(rows: "Sequence[ParameterSetResults]", columns: int | None = None) -> str:
    """Return a table with a line for each parameter set, followed by the consistency (ANEES) of each parameter set.

    Lines are wrapped at `columns` characters; None stands for unlimited width.
    """
    head = ("parameters", *COLUMN_NAMES.values(), "median error", "ms a scan", "slowest")
    lines = table_lines(head, [_cells(row) for row in rows], columns)
    return "\n".join(wrap_lines([*lines, "", *(line for row in rows for line in _consistency_lines(row))], columns))


def _cells(row: "ParameterSetResults") -> tuple[str, ...]:
    return (
        row.parameters,
        *(_success_text(row.shares[name]) for name in COLUMN_NAMES),
        f"{row.median:.3f} m",
        f"{row.ms:.1f}",
        f"{row.slowest_ms:.0f}",
    )


def _success_text(rate: "SuccessRate") -> str:
    interval = "" if rate.interval is None else f" ({_interval_text(rate.interval)})"
    return f"{rate.count} of {rate.of}{interval}"


def _interval_text(interval: tuple[float, float]) -> str:
    return f"{interval[0]:.2f} … {interval[1]:.2f}"


def _consistency_lines(row: "ParameterSetResults") -> list[str]:
    """Return the name of the parameter set, and two lines for each circumstance.

    The first line has the ANEES of all samples, and the second the ANEES at fixed times. Each line has the 95 %
    interval of a consistent localizer.
    """
    from simscen.bench.localization.campaign import CHECK_TIMES_S

    def lines(name: str, consistency: "Consistency") -> list[str]:
        interval = ""
        if consistency.bounds is not None:
            interval = f" (95 % interval of a consistent localizer: {_interval_text(consistency.bounds)})"
        pairs = zip(CHECK_TIMES_S, consistency.anees_by_time, strict=True)
        values = ", ".join(f"{value:.2f} at {seconds:g} s" for seconds, value in pairs)
        inside = f"{consistency.inside:.1%} of the errors in the 95 % ellipsoid"
        return [
            f"  ANEES {name}: {consistency.anees:.2f}{interval}; {inside}",
            f"    {values} (95 % interval if logs are independent: {_interval_text(consistency.bounds_by_time)})",
        ]

    return [
        row.parameters,
        *(line for name, consistency in row.consistency.items() for line in lines(name, consistency)),
    ]
