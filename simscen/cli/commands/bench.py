"""Command `simscen bench`, which measures speed; its subcommands also measure navigation and localization."""

import json
import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.cli.benchmarks import localization, navigation, results
from simscen.cli.benchmarks.results import COMPARE_HELP, Result, load_baseline, print_progress, print_result
from simscen.cli.diagnostics import print_text
from simscen.cli.shared_options import TextOrJson
from simscen.core.errors import Exit

if TYPE_CHECKING:
    from simscen.bench.speed.large_worlds import WorldCost
    from simscen.bench.speed.run_overhead import ExternalStackCost, Overhead
    from simscen.bench.speed.run_speed import ObstacleFieldTimes, PatrolTimes
    from simscen.bench.speed.session_speed import SuiteResult


def growth_command(
    format_: Annotated[TextOrJson, typer.Option("--format", help="Output format.")] = TextOrJson.TEXT,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Number of runs of each; the median is used.")] = 3,
    compare: Annotated[Path | None, typer.Option("--compare", metavar="FILE", help=COMPARE_HELP)] = None,
) -> None:
    """Measure how the cost of a simulated second grows with the size of the scenario.

    Repeats a patrol of 15 s and increases one quantity at a time: static obstacles, pushable objects, scripted objects,
    lidar beams, AMCL particles, or robots. Prints CPU times of one core. Takes a minute and a half.
    """
    from simscen.cli.process import engine_output_on_stderr

    before = load_baseline(compare)
    with engine_output_on_stderr():
        from simscen.bench.speed.growth import measure_growth

        figures = measure_growth(rounds, print_progress)
    print_result(Result.on_this_machine(figures), growth_text(figures), {}, format_, before)


def growth_text(figures: Measurements) -> str:
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
    as_json: Annotated[bool, typer.Option("--json", help="Print all numbers as JSON.")] = False,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Number of runs in each world; the median is used.")] = 3,
) -> None:
    """Measure the cost of a simulated second in large worlds.

    The worlds are a house, a generated hall with 40 movable meshes, a generated warehouse with 5000 objects, and a
    generated ROS map of 100 x 100 m with 400 blocks and noise. Each run takes at most 60 simulated seconds with all
    features enabled. Prints the CPU time of one core, also as a multiple of the time for the house.
    """
    from simscen.cli.process import engine_output_on_stderr

    with engine_output_on_stderr():
        from simscen.bench.speed.large_worlds import measure_worlds

        costs = list(measure_worlds(rounds))
    print_text(json.dumps([asdict(cost) for cost in costs], indent=2) if as_json else worlds_text(costs))


def worlds_text(costs: "Sequence[WorldCost]") -> str:
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
    format_: Annotated[TextOrJson, typer.Option("--format", help="Output format.")] = TextOrJson.TEXT,
    compare: Annotated[Path | None, typer.Option("--compare", metavar="FILE", help=COMPARE_HELP)] = None,
) -> None:
    """Measure the speed of a suite of scenarios on all cores.

    Runs at most --most scenarios once each, with all steps of `simscen run` except reports. Prints the runs per minute,
    the wall time of the session, and the memory of the workers. The wall time is also printed as a multiple of a
    baseline: the time of PyBullet alone on one core for the same steps and scans, measured before and after the
    session.

    Exit code 0: all runs were completed; 3: a run was aborted.
    """
    from simscen.cli.process import engine_output_on_stderr
    from simscen.cli.session.backends import FORK_SERVER
    from simscen.cli.session.selection import Selection, load_selection

    before = load_baseline(compare)
    workers = jobs or len(os.sched_getaffinity(0))
    with engine_output_on_stderr(), TemporaryDirectory() as folder:
        from simscen.bench.speed.session_speed import evenly_spaced, measure_suite

        scenarios, _ = load_selection(paths or [Path("scenarios")], None, (), False, Selection())
        suite = measure_suite(evenly_spaced(scenarios, most), workers, Path(folder), FORK_SERVER, print_progress)
    print_result(Result.on_this_machine(suite.figures), suite_text(suite), {"suite": asdict(suite)}, format_, before)
    if suite.unfinished:
        print(f"{len(suite.unfinished)} runs were aborted: {', '.join(suite.unfinished)}", file=sys.stderr)
        sys.exit(Exit.INCOMPLETE)


def suite_text(suite: "SuiteResult") -> str:
    """Return the printed lines about a suite: wall time, CPU time, and memory."""
    figures, baseline = suite.figures, suite.baseline * suite.simulated
    duration = f"{suite.simulated:.0f} s simulated in {suite.wall:.1f} s of wall time, {suite.workers} at a time"
    return "\n".join([
        f"{suite.runs} runs, {duration}",
        f"  {figures['suite: runs a minute'].value:.0f} runs a minute",
        f"  {suite.wall / baseline:.2f} times what PyBullet alone takes on one core to step and scan as long"
        f" ({baseline:.1f} s)",
        f"  CPU time {suite.cpu / baseline:.2f} times that,"
        f" {1e3 * suite.cpu / suite.simulated:.1f} ms per simulated second",
        f"  memory of a worker {figures['suite: memory of a worker'].value:.0f} MB,"
        f" of the largest {figures['suite: memory of the largest worker'].value:.0f} MB",
    ])  # fmt: skip


app = typer.Typer(rich_markup_mode=None, add_completion=False)
app.command("suite")(suite_command)
app.command("growth")(growth_command)
app.command("worlds")(worlds_command)
app.command("compare")(results.compare_command)
app.command("nav")(navigation.command)
app.command("localization")(localization.command)


@app.callback(invoke_without_command=True)
def command(
    ctx: typer.Context,
    format_: Annotated[TextOrJson, typer.Option("--format", help="Output format.")] = TextOrJson.TEXT,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Number of runs of the patrol; the median is used.")] = 5,
    compare: Annotated[Path | None, typer.Option("--compare", metavar="FILE", help=COMPARE_HELP)] = None,
) -> None:
    """Measure speed, navigation, and localization.

    Without a subcommand, simulates a patrol of 60 s on one core with all features enabled: 240 Hz physics, 360 beams at
    10 Hz, 500 to 2000 particles, and a full MCAP log. Prints:

    - the speed relative to real time, and to PyBullet alone with the same steps and scans, and the share of each part

    - the overhead of a run: set-up and verdicts, its process, the start of a session, and the memory of a worker

    - the time of a scan of 720 beams and of a physics step among obstacles, compared to PyBullet with one body for each
      obstacle

    - the wall time per cycle for which a run waits for an external stack

    All other times are CPU times. Takes less than a minute on an idle machine; the subcommands take longer. --compare
    compares the result with an earlier result of --format json, and the subcommand `compare` compares two such results.
    """
    if ctx.invoked_subcommand is not None:
        return
    from simscen.cli.process import engine_output_on_stderr
    from simscen.cli.session.backends import FORK_SERVER

    before = load_baseline(compare)
    with engine_output_on_stderr():
        from simscen.bench.speed import run_speed
        from simscen.bench.speed.run_overhead import measure_external, measure_overhead

        patrol = run_speed.measure_patrol(rounds, print_progress)
        overhead = measure_overhead(rounds, FORK_SERVER, print_progress)
        print_progress("fields of obstacles")
        fields = [run_speed.measure_obstacle_field(count) for count in (209, 2090)]
        print_progress("the stack as an external process")
        external = measure_external(max(1, rounds // 2))
    figures = {**_patrol_figures(patrol), **overhead.figures, **_field_and_stack_figures(fields, external)}
    lines = [*_patrol_lines(patrol, rounds), *_overhead_lines(overhead), *_field_lines(fields)]
    text = "\n".join([*lines, *_external_lines(external)])
    print_result(Result.on_this_machine(figures), text, _sections(patrol, overhead, fields, external), format_, before)


def _sections(
    patrol: "PatrolTimes", overhead: "Overhead", fields: "list[ObstacleFieldTimes]", external: "ExternalStackCost"
) -> dict[str, Any]:
    """Return the further keys of the JSON output."""
    return {
        "patrol": {**asdict(patrol), "real_time_factor": patrol.factor, "ratio_to_bare": patrol.ratio},
        "overhead": asdict(overhead),
        "fields": [asdict(field) for field in fields],
        "external": {**asdict(external), "ratio": external.ratio},
    }


def _patrol_figures(patrol: "PatrolTimes") -> Measurements:
    scale, unit = 1e3 / patrol.simulated, "ms per simulated second"
    return {
        "patrol, times PyBullet alone": Measurement.of(patrol.ratios, ""),
        "patrol": Measurement.of([scale * cpu for cpu in patrol.cpu_rounds], unit),
        "PyBullet alone": Measurement.of([scale * baseline for baseline in patrol.baseline_rounds], unit),
        **{
            name: Measurement.of([scale * seconds for seconds in rounds], unit)
            for name, rounds in patrol.part_rounds.items()
        },
    }


def _field_and_stack_figures(fields: "list[ObstacleFieldTimes]", external: "ExternalStackCost") -> Measurements:
    figures = dict[str, Measurement]()
    for field in fields:
        figures[f"scan among {field.obstacles} obstacles"] = Measurement(field.scan_ms, "ms")
        figures[f"step among {field.obstacles} obstacles"] = Measurement(field.step_us, "µs")
    return {**figures, "cycle with the stack as a process": Measurement(external.external_us, "µs")}


def _patrol_lines(patrol: "PatrolTimes", rounds: int) -> list[str]:
    width = max(map(len, patrol.parts))
    shares = sorted(patrol.parts.items(), key=lambda part: -part[1])
    ratio = f"{patrol.ratio:.2f} times the time of PyBullet alone for the same steps and scans"
    spread = f"{min(patrol.ratios):.2f} … {max(patrol.ratios):.2f} in single rounds"
    return [
        f"patrol of {patrol.simulated:g} s, all features, one core",
        f"  {patrol.factor:.0f} times real time ({patrol.cpu:.2f} s of CPU time, median of {rounds})",
        f"  {ratio} ({patrol.baseline:.2f} s; {spread})",
        f"    {'':{width}}  share   ms per simulated second   times PyBullet alone",
        *(
            f"    {n:{width}} {s / patrol.cpu:6.1%} {1e3 * s / patrol.simulated:25.2f} {s / patrol.baseline:22.2f}"
            for n, s in shares
        ),
    ]


def _overhead_lines(overhead: "Overhead") -> list[str]:
    width = max(map(len, overhead.figures))
    lines = [f"    {name:{width}} {figure.value:7.1f} {figure.unit}" for name, figure in overhead.figures.items()]
    return ["overhead of a run (CPU time unless noted otherwise)", *lines]


def _field_lines(fields: "list[ObstacleFieldTimes]") -> list[str]:
    return [
        "a scan of 720 beams and a physics step among cylinders",
        "    obstacles      scan   PyBullet alone      step   PyBullet alone",
        *(
            f"    {f.obstacles:9} {f.scan_ms:6.2f} ms {f.baseline_scan_ms:13.2f} ms"
            f" {f.step_us:6.0f} µs {f.baseline_step_us:13.0f} µs"
            for f in fields
        ),
    ]


def _external_lines(external: "ExternalStackCost") -> list[str]:
    return [
        f"the stack of the patrol as an external process with all topics, {external.cycles} cycles",
        f"    {external.external_us:.0f} µs per cycle; "
        f"in process {external.in_process_us:.0f} µs ({external.ratio:.1f} times)",
    ]
