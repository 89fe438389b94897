"""Subcommands `growth`, `worlds`, and `suite` of `simscen bench`, which measure the speed of larger simulations."""

import json
import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.bench.speed.measurement import Measurements
from simscen.cli.benchmarks.results import CompareOption, FormatOption, print_progress, print_result, read_result
from simscen.cli.diagnostics import print_text
from simscen.cli.process import engine_output_on_stderr
from simscen.cli.shared_options import TextOrJson
from simscen.core.errors import Exit

if TYPE_CHECKING:
    from simscen.bench.speed.large_worlds import WorldCost
    from simscen.bench.speed.session_speed import SuiteResult


def growth_command(
    format_: FormatOption = TextOrJson.TEXT,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Number of runs of each size; the median is used.")] = 3,
    compare: CompareOption = None,
) -> None:
    """Measure how the cost of a simulated second grows with the size of the scenario.

    Repeats a patrol of 15 s and increases one quantity at a time: static obstacles, pushable objects, moving objects,
    lidar beams, AMCL particles, or robots. Prints CPU times of one core. Takes a minute and a half.
    """
    before = None if compare is None else read_result(compare)
    with engine_output_on_stderr():
        from simscen.bench.speed.growth import measure_growth

        figures = measure_growth(rounds, print_progress)
    print_result(figures, _growth_text(figures), {}, format_, before)


def _growth_text(figures: Measurements) -> str:
    """Return one line per figure, with its ratio to the first figure of the same quantity."""
    width = max(map(len, figures))
    lines = ["the patrol with                 CPU per simulated second"]
    first: dict[str, float] = {}
    for name, figure in figures.items():
        kind = name.partition(" ")[2]
        ratio = figure.value / first.setdefault(kind, figure.value)
        lines.append(f"    {name:{width}}  {figure.value:9.1f} ms  {ratio:6.2f} times")
    return "\n".join(lines)


def worlds_command(
    format_: FormatOption = TextOrJson.TEXT,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Number of runs in each world; the median is used.")] = 3,
    as_json: Annotated[bool, typer.Option("--json", hidden=True)] = False,
) -> None:
    """Measure the cost of a simulated second in large worlds.

    The worlds are a house, a generated hall with 40 movable meshes, a generated warehouse with 5000 objects, and a
    generated ROS map of 100 x 100 m with 400 blocks and noise. Each run takes at most 60 simulated seconds with all
    features enabled. Prints the CPU time of one core, also as a multiple of the time for the house.
    """
    if as_json:
        print("simscen: warning: --json is deprecated; use --format json", file=sys.stderr)
        format_ = TextOrJson.JSON
    with engine_output_on_stderr():
        from simscen.bench.speed.large_worlds import measure_worlds

        costs = list(measure_worlds(rounds))
    if format_ is TextOrJson.JSON:
        print(json.dumps([asdict(cost) for cost in costs], indent=2))
    else:
        print_text(_worlds_text(costs))


def _worlds_text(costs: "Sequence[WorldCost]") -> str:
    """Return one line per world. Ratios are relative to the first world."""
    width = max(len(cost.name) for cost in costs)
    lines = [f"{'':{width}}  triangles  movable  CPU a second   ratio  preparing   memory"]
    lines += [
        f"{c.name:{width}}  {c.triangles:9}  {c.movable:7}  {c.milliseconds:9.1f} ms"
        f"  {c.milliseconds / costs[0].milliseconds:6.2f}  {c.preparing:7.2f} s  {c.memory:4.0f} MB"
        for c in costs
    ]
    return "\n".join(lines)


def suite_command(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(help="Scenario files, or folders to search; default: scenarios.", show_default=False),
    ] = None,
    most: Annotated[
        int, typer.Option(min=1, max=100_000, help="Maximum number of runs, evenly selected from all.")
    ] = 60,
    jobs: Annotated[
        int | None, typer.Option("--jobs", "-j", min=1, max=256, help="Number of parallel runs; default: one per core.")
    ] = None,
    format_: FormatOption = TextOrJson.TEXT,
    compare: CompareOption = None,
) -> None:
    """Measure the speed of a suite of scenarios on all cores.

    Runs at most --most scenarios once each, with all steps of `simscen run` except reports. Prints the runs per minute,
    the wall time of the session, and the memory of the workers. The wall time is also printed as a multiple of a
    baseline: the time of PyBullet alone on one core for the same steps and scans, measured before and after the
    session.

    Exit code 0: all runs were completed; 3: a run was aborted. If all runs were aborted, nothing is measured.
    """
    from simscen.cli.session.fork_server_start import FORK_SERVER
    from simscen.cli.session.selection import Selection, load_selection

    before = None if compare is None else read_result(compare)
    workers = jobs or len(os.sched_getaffinity(0))
    with engine_output_on_stderr(), TemporaryDirectory() as folder:
        from simscen.bench.speed.session_speed import evenly_spaced, measure_suite

        scenarios, _ = load_selection(paths or [Path("scenarios")], None, (), False, Selection())
        suite = measure_suite(evenly_spaced(scenarios, most), workers, Path(folder), FORK_SERVER, print_progress)
    if suite.simulated:
        print_result(suite.figures, _suite_text(suite), {"suite": asdict(suite)}, format_, before)
    if suite.unfinished:
        print(f"{len(suite.unfinished)} runs were aborted: {', '.join(suite.unfinished)}", file=sys.stderr)
        sys.exit(Exit.INCOMPLETE)


def _suite_text(suite: "SuiteResult") -> str:
    figures, baseline = suite.figures, suite.baseline * suite.simulated
    duration = f"{suite.simulated:.0f} s simulated in {suite.wall:.1f} s of wall time, {suite.workers} at a time"
    return "\n".join([
        f"{suite.runs} runs, {duration}",
        f"  {figures['suite: runs a minute'].value:.0f} runs a minute",
        f"  PyBullet alone, for the same steps and scans on one core: {baseline:.1f} s",
        f"  wall time: {suite.wall / baseline:.2f} times PyBullet alone",
        f"  CPU time: {suite.cpu / baseline:.2f} times PyBullet alone,"
        f" {1e3 * suite.cpu / suite.simulated:.1f} ms per simulated second",
        f"  memory of a worker: {figures['suite: memory of a worker'].value:.0f} MB,"
        f" of the largest: {figures['suite: memory of the largest worker'].value:.0f} MB",
    ])  # fmt: skip
