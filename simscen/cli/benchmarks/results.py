"""Results of `simscen bench` as files: what is written, and read again to be compared."""

import json
import sys
from dataclasses import asdict, dataclass
from enum import Enum
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.cli.diagnostics import print_text
from simscen.cli.installation import processor
from simscen.core.errors import UsageError

FORMAT = 1
"""Of the JSON; another number means that names or meanings have changed."""


@dataclass(frozen=True)
class Result:
    """What one call has measured, where and with which version of simscen."""

    figures: Measurements
    machine: str
    simscen: str

    @classmethod
    def here(cls, figures: Measurements) -> "Result":
        """Measured just now."""
        return cls(figures, processor(), version("simscen"))


def as_json(result: Result, sections: dict[str, Any] | None = None) -> str:
    """All numbers; `sections` are what they were worked out from."""
    told = {"simscen_bench": FORMAT, "simscen": result.simscen, "machine": result.machine}
    figures = {name: asdict(figure) for name, figure in result.figures.items()}
    return json.dumps({**told, "figures": figures, **(sections or {})}, indent=2)


def read_result(file: Path) -> Result:
    """A result that was written as JSON. Raises UsageError for what is none, or of another version."""
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "no text"
        raise UsageError(f"cannot read {file}: {why}") from None
    try:
        told = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{file} is no result of `simscen bench --format json`: {error}") from None
    if not isinstance(told, dict) or "simscen_bench" not in told:
        raise UsageError(f"{file} is no result of `simscen bench --format json`: it has no key `simscen_bench`")
    if told["simscen_bench"] != FORMAT:
        other = f"format {told['simscen_bench']!r}, this version reads {FORMAT}"
        raise UsageError(
            f"{file} is a result of another version of simscen bench ({other}): measure again with this one"
        )
    try:
        figures = {str(name): _figure(entry) for name, entry in told["figures"].items()}
        return Result(figures, str(told["machine"]), str(told["simscen"]))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UsageError(f"{file} is a damaged result of simscen bench: {type(error).__name__} at {error}") from None


def _figure(entry: dict[str, Any]) -> Measurement:
    rounds = tuple(float(value) for value in entry["rounds"])
    return Measurement(float(entry["value"]), str(entry["unit"]), rounds, bool(entry["more_is_better"]))


HEAD = ("", "before", "after", "ratio", "rounds before", "rounds after", "")
FEWEST = 2
"""Rounds from which on something can be said about noise."""


def compare_command(
    before: Annotated[Path, typer.Argument(help="A result of --format json.")],
    after: Annotated[Path, typer.Argument(help="Another one.")],
) -> None:
    """Hold two results of `simscen bench --format json` against each other.

    For each figure that both have: before, after, their ratio, and the least and the most of its rounds. Where these
    overlap the difference is noise. Times are those of a machine: of results from two machines only ratios tell.
    """
    print_text(comparison_text(read_result(before), read_result(after)))


def comparison_text(before: Result, after: Result) -> str:
    """A line for each figure of both, then what only one of them has. Raises UsageError when they share none."""
    common = [name for name in after.figures if name in before.figures]
    if not common:
        raise UsageError("the two results have no figure in common: compare results of the same command")
    table = [HEAD, *(_row(name, before.figures[name], after.figures[name]) for name in common)]
    widths = [max(len(row[column]) for row in table) for column in range(len(HEAD))]
    lines = [_aligned(row, widths) for row in table]
    for only, where in ((before.figures, "before"), (after.figures, "after")):
        if names := [name for name in only if name not in common]:
            lines.append(f"only {where}: " + ", ".join(names))
    if before.simscen != after.simscen:
        lines.append(f"simscen {before.simscen} before, {after.simscen} after")
    if before.machine != after.machine:
        lines.append(f"not the same machine: {before.machine} before, {after.machine} after; only ratios tell")
    return "\n".join(lines)


def judgment(before: Measurement, after: Measurement) -> str:
    """`noise` where the rounds overlap, `better` or `worse` where they do not; "" where there are too few of them."""
    if min(len(before.rounds), len(after.rounds)) < FEWEST:
        return ""
    if min(after.rounds) <= max(before.rounds) and min(before.rounds) <= max(after.rounds):
        return "noise"
    return "better" if (after.value > before.value) == after.more_is_better else "worse"


def _row(name: str, before: Measurement, after: Measurement) -> tuple[str, ...]:
    ratio = f"{after.value / before.value:.2f}" if before.value else "-"
    values = (_value(before.value, before.unit), _value(after.value, after.unit))
    return name, *values, ratio, _spread(before), _spread(after), judgment(before, after)


def _value(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip()


def _spread(figure: Measurement) -> str:
    return f"{min(figure.rounds):.4g} … {max(figure.rounds):.4g}" if len(figure.rounds) > 1 else "-"


def _aligned(row: tuple[str, ...], widths: list[int]) -> str:
    first, *rest = zip(row, widths, strict=True)
    return "  ".join((first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in rest))).rstrip()


class Format(str, Enum):
    """What is printed."""

    TEXT = "text"
    JSON = "json"


COMPARE_HELP = "A result of this command as JSON: what has changed since, and what of that is noise."


def print_progress(what: str) -> None:
    """Say on a terminal what is being measured."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{what}", end="", file=sys.stderr, flush=True)


def print_result(result: Result, text: str, sections: dict[str, Any], format_: Format, before: Result | None) -> None:
    """Print a result; as text also how it compares with one from before."""
    print_progress("")
    if format_ is Format.JSON:
        print(as_json(result, sections))
        return
    print_text(text)
    if before is not None:
        print_text("\n" + comparison_text(before, result))


def load_baseline(file: Path | None) -> Result | None:
    """The result to compare with, read before anything is measured. Raises UsageError."""

    return None if file is None else read_result(file)
