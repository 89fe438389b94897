"""Two results of `simscen bench` against each other."""

from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.bench_result import Result, read_result
from simscen.cli.diagnostics import print_text
from simscen.core.errors import UsageError
from simscen.run.figure import Figure

HEAD = ("", "before", "after", "ratio", "rounds before", "rounds after", "")
FEWEST = 2
"""Rounds from which on something can be said about noise."""


def command(
    before: Annotated[Path, typer.Argument(help="A result of --format json.")],
    after: Annotated[Path, typer.Argument(help="Another one.")],
) -> None:
    """Hold two results of `simscen bench --format json` against each other.

    For each figure that both have: before, after, their ratio, and the least and the most of its rounds. Where these
    overlap the difference is noise. Times are those of a machine: of results from two machines only ratios tell.
    """
    print_text(as_text(read_result(before), read_result(after)))


def as_text(before: Result, after: Result) -> str:
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


def judgement(before: Figure, after: Figure) -> str:
    """`noise` where the rounds overlap, `better` or `worse` where they do not; "" where there are too few of them."""
    if min(len(before.rounds), len(after.rounds)) < FEWEST:
        return ""
    if min(after.rounds) <= max(before.rounds) and min(before.rounds) <= max(after.rounds):
        return "noise"
    return "better" if (after.value > before.value) == after.more_is_better else "worse"


def _row(name: str, before: Figure, after: Figure) -> tuple[str, ...]:
    ratio = f"{after.value / before.value:.2f}" if before.value else "-"
    values = (_value(before.value, before.unit), _value(after.value, after.unit))
    return name, *values, ratio, _spread(before), _spread(after), judgement(before, after)


def _value(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip()


def _spread(figure: Figure) -> str:
    return f"{min(figure.rounds):.4g} … {max(figure.rounds):.4g}" if len(figure.rounds) > 1 else "-"


def _aligned(row: tuple[str, ...], widths: list[int]) -> str:
    first, *rest = zip(row, widths, strict=True)
    return "  ".join((first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in rest))).rstrip()
