"""Results of the speed benchmarks of `simscen bench`: JSON files, printed output, and comparison of two results.

A figure is a measured value with a name. A round is one of several repeated measurements of a figure.
"""

import json
import sys
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.cli.benchmarks.tables import align_columns
from simscen.cli.diagnostics import print_text
from simscen.cli.installation import describe_processor
from simscen.cli.shared_options import TextOrJson
from simscen.core.errors import UsageError

FORMAT_VERSION = 1
"""Version of the JSON format."""


@dataclass(frozen=True)
class Result:
    """Figures that one call of `simscen bench` measured, the machine, and the version of simscen."""

    figures: Measurements
    machine: str
    simscen: str


def as_json(result: Result, sections: dict[str, Any] | None = None) -> str:
    """Return the result as JSON, with the further keys `sections`."""
    header = {"simscen_bench": FORMAT_VERSION, "simscen": result.simscen, "machine": result.machine}
    figures = {name: asdict(figure) for name, figure in result.figures.items()}
    return json.dumps({**header, "figures": figures, **(sections or {})}, indent=2)


def read_result(file: Path) -> Result:
    """Read a result from a JSON file. Raises UsageError if the file is unreadable, or has another format or version."""
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise UsageError(f"cannot read {file}: {reason}") from None
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{file} is not a result of `simscen bench --format json`: {error}") from None
    if not isinstance(data, dict) or "simscen_bench" not in data:
        raise UsageError(f"{file} is not a result of `simscen bench --format json`: the key `simscen_bench` is missing")
    if data["simscen_bench"] != FORMAT_VERSION:
        versions = f"format {data['simscen_bench']!r}, this version reads {FORMAT_VERSION}"
        raise UsageError(
            f"{file} is a result of another version of simscen bench ({versions}): measure again with this one"
        )
    try:
        figures = {str(name): _parse_figure(entry) for name, entry in data["figures"].items()}
        return Result(figures, str(data["machine"]), str(data["simscen"]))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UsageError(f"{file} is a damaged result of simscen bench: {type(error).__name__} at {error}") from None


def _parse_figure(entry: dict[str, Any]) -> Measurement:
    rounds = tuple(float(value) for value in entry["rounds"])
    return Measurement(float(entry["value"]), str(entry["unit"]), rounds, bool(entry["more_is_better"]))


COMPARISON_HEAD = ("", "before", "after", "ratio", "rounds before", "rounds after", "")
"""Column headings of the comparison. The first column has the name of the figure, and the last its judgment."""
MIN_ROUNDS = 2
"""Minimum number of rounds of a figure to distinguish changes from noise."""


def compare_command(
    before: Annotated[Path, typer.Argument(help="Result of --format json.")],
    after: Annotated[Path, typer.Argument(help="Another result to compare with it.")],
) -> None:
    """Compare two results of `simscen bench --format json`.

    For each common figure, print the value before and after, their ratio, and the range of its rounds. If the ranges
    overlap, the difference is noise. Times depend on the machine: compare only ratios of results from two machines.
    """
    print_text(comparison_text(read_result(before), read_result(after)))


def comparison_text(before: Result, after: Result) -> str:
    """Return one line for each common figure, and then the names of the other figures.

    Raises UsageError if the results have no common figure.
    """
    common = [name for name in after.figures if name in before.figures]
    if not common:
        raise UsageError("the two results have no common figure; compare results of the same command")
    table = [COMPARISON_HEAD, *(_comparison_row(name, before.figures[name], after.figures[name]) for name in common)]
    lines = align_columns(table)
    for figures, label in ((before.figures, "before"), (after.figures, "after")):
        if names := [name for name in figures if name not in common]:
            lines.append(f"only {label}: " + ", ".join(names))
    if before.simscen != after.simscen:
        lines.append(f"simscen {before.simscen} before, {after.simscen} after")
    if before.machine != after.machine:
        lines.append(f"different machines: {before.machine} before, {after.machine} after; compare only ratios")
    return "\n".join(lines)


def judgment(before: Measurement, after: Measurement) -> str:
    """Return "noise" if the ranges of all rounds overlap, otherwise "better" or "worse"; "" with too few rounds."""
    if min(len(before.rounds), len(after.rounds)) < MIN_ROUNDS:
        return ""
    if min(after.rounds) <= max(before.rounds) and min(before.rounds) <= max(after.rounds):
        return "noise"
    return "better" if (after.value > before.value) == after.more_is_better else "worse"


def _comparison_row(name: str, before: Measurement, after: Measurement) -> tuple[str, ...]:
    ratio = f"{after.value / before.value:.2f}" if before.value else "-"
    values = (_value_text(before.value, before.unit), _value_text(after.value, after.unit))
    return name, *values, ratio, _spread(before), _spread(after), judgment(before, after)


def _value_text(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip()


def _spread(figure: Measurement) -> str:
    """Return the range of the rounds as text; "-" for a single measurement."""
    return f"{min(figure.rounds):.4g} … {max(figure.rounds):.4g}" if len(figure.rounds) > 1 else "-"


CompareOption = Annotated[
    Path | None,
    typer.Option(
        "--compare",
        metavar="FILE",
        help="Compare with this result of --format json, and mark differences that are within the noise.",
    ),
]
FormatOption = Annotated[TextOrJson, typer.Option("--format", help="Output format.")]


def print_progress(text: str) -> None:
    """Replace the progress line on stderr by this text. Print nothing if stderr is not a terminal."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)


def print_result(
    figures: Measurements, text: str, sections: dict[str, Any], format_: TextOrJson, before: Result | None
) -> None:
    """Print figures that this machine has measured.

    The format TEXT prints `text`, followed by the comparison with the earlier result `before`, if there is one. The
    format JSON prints the figures, with the further keys `sections`.
    """
    result = Result(figures, describe_processor(), version("simscen"))
    print_progress("")
    if format_ is TextOrJson.JSON:
        print(as_json(result, sections))
        return
    print_text(text)
    if before is not None:
        print_text("\n" + comparison_text(before, result))
