"""`simscen bench suite`: how fast a suite is run on all cores."""

import os
import sys
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.cli.bench_result import Result
from simscen.cli.bench_told import COMPARE, Format, earlier, show, tell
from simscen.core.errors import Exit

if TYPE_CHECKING:
    from simscen.run.benchsuite import Suite


def command(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(help="Scenario files, or folders to search; default: scenarios.", show_default=False),
    ] = None,
    most: Annotated[int, typer.Option(min=1, max=100_000, help="At most so many runs, evenly taken from all.")] = 60,
    jobs: Annotated[
        int | None, typer.Option("--jobs", "-j", min=1, max=256, help="Runs at a time; default: one for each core.")
    ] = None,
    format_: Annotated[Format, typer.Option("--format", help="What to print.")] = Format.TEXT,
    compare: Annotated[Path | None, typer.Option("--compare", metavar="FILE", help=COMPARE)] = None,
) -> None:
    """Measure how fast a suite of scenarios is run on all cores.

    Each scenario once, with everything that `simscen run` does but reports: runs a minute, wall time from the session's
    start to its end as a multiple of what PyBullet alone takes on one core to step and scan for the same simulated time
    (measured before and after), memory of the workers. Exit code 0, or 3 when a run broke off.
    """
    from simscen.cli.quiet import engine_output_on_stderr
    from simscen.cli.runsession import WARM_PROCESS
    from simscen.cli.select import Selection, load_all

    before = earlier(compare)
    workers = jobs or len(os.sched_getaffinity(0))
    with engine_output_on_stderr(), TemporaryDirectory() as folder:
        from simscen.run.benchsuite import measure_suite, spread_over

        scenarios, _ = load_all(paths or [Path("scenarios")], None, (), False, Selection())
        suite = measure_suite(spread_over(scenarios, most), workers, Path(folder), WARM_PROCESS, tell)
    show(Result.here(suite.figures), as_text(suite), {"suite": asdict(suite)}, format_, before)
    if suite.unfinished:
        print(f"{len(suite.unfinished)} runs broke off: {', '.join(suite.unfinished)}", file=sys.stderr)
        sys.exit(Exit.INCOMPLETE)


def as_text(suite: "Suite") -> str:
    """What it took, on how many cores, and beside PyBullet alone."""
    figures, alone = suite.figures, suite.bare * suite.simulated
    took = f"{suite.simulated:.0f} s simulated in {suite.wall:.1f} s of wall time, {suite.workers} at a time"
    return "\n".join([
        f"{suite.runs} runs, {took}",
        f"  {figures['suite: runs a minute'].value:.0f} runs a minute",
        f"  {suite.wall / alone:.2f} times what PyBullet alone takes on one core to step and scan as long"
        f" ({alone:.1f} s)",
        f"  CPU time {suite.cpu / alone:.2f} times that, {1e3 * suite.cpu / suite.simulated:.1f} ms a simulated second",
        f"  memory of a worker {figures['suite: memory of a worker'].value:.0f} MB,"
        f" of the largest {figures['suite: memory of the largest worker'].value:.0f} MB",
    ])  # fmt: skip
