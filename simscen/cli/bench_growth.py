"""`simscen bench growth`: how the cost grows with what there is."""

from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.bench_result import Result
from simscen.cli.bench_told import COMPARE, Format, earlier, show, tell
from simscen.run.figure import Figures


def command(
    format_: Annotated[Format, typer.Option("--format", help="What to print.")] = Format.TEXT,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Runs of each; the median counts.")] = 3,
    compare: Annotated[Path | None, typer.Option("--compare", metavar="FILE", help=COMPARE)] = None,
) -> None:
    """Measure how the cost of a simulated second grows with what there is.

    The patrol of 15 s with more of one thing at a time: obstacles that stand, objects that could be pushed, objects
    that a script moves, beams of the lidar, particles of AMCL, robots. CPU time of one core; a minute and a half.
    """
    from simscen.cli.quiet import engine_output_on_stderr

    before = earlier(compare)
    with engine_output_on_stderr():
        from simscen.run.benchgrowth import measure_growth

        figures = measure_growth(rounds, tell)
    show(Result.here(figures), as_text(figures), {}, format_, before)


def as_text(figures: Figures) -> str:
    """A line for each; beside it how many times as much as the least of its kind."""
    width = max(map(len, figures))
    lines = ["the patrol with                 CPU a simulated second"]
    first: dict[str, float] = {}
    for name, figure in figures.items():
        kind = name.partition(" ")[2]
        ratio = figure.value / first.setdefault(kind, figure.value)
        lines.append(f"    {name:{width}}  {figure.value:9.1f} ms  {ratio:6.2f} times")
    return "\n".join(lines)
