"""Command `simscen bench`, which measures speed, and its subcommands."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.cli.benchmarks import localization, navigation, results, speed
from simscen.cli.benchmarks.results import COMPARE_HELP, Format, Result, load_baseline, print_progress, print_result

if TYPE_CHECKING:
    from simscen.bench.speed.run_speed import Field, Patrol
    from simscen.bench.speed.session_speed import ExternalStackCost, Overhead

app = typer.Typer(rich_markup_mode=None, add_completion=False)
app.command("suite")(speed.suite_command)
app.command("growth")(speed.growth_command)
app.command("worlds")(speed.worlds_command)
app.command("compare")(results.compare_command)
app.command("nav")(navigation.command)
app.command("localization")(localization.command)


@app.callback(invoke_without_command=True)
def command(
    ctx: typer.Context,
    format_: Annotated[Format, typer.Option("--format", help="Output format.")] = Format.TEXT,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Number of runs of the patrol; the median is used.")] = 5,
    compare: Annotated[Path | None, typer.Option("--compare", metavar="FILE", help=COMPARE_HELP)] = None,
) -> None:
    """Measure speed, navigation, and localization.

    Without a subcommand, measures a patrol of 60 s with all features enabled (240 Hz physics, 360 beams at 10 Hz, 500
    to 2000 particles, full MCAP log) on one core: speed relative to real time and to PyBullet alone with the same steps
    and scans, and the share of each part; the overhead of a run: set-up and verdicts, its process, the start of a
    session, and the memory of a worker; a scan of 720 beams and a step in two fields of obstacles, compared to PyBullet
    with one body each; and the patrol with its stack as an external process: wall time that the engine waits for it per
    cycle. Other times are CPU times.

    Takes less than a minute on an idle machine. The subcommands take longer. --compare FILE compares the result with
    one of --format json, `compare` compares two of them.
    """
    if ctx.invoked_subcommand is not None:
        return
    from simscen.cli.process import engine_output_on_stderr
    from simscen.cli.session.backends import WARM_PROCESS

    before = load_baseline(compare)
    with engine_output_on_stderr():
        from simscen.bench.speed import run_speed
        from simscen.bench.speed.session_speed import measure_external, measure_overhead

        patrol = run_speed.measure_patrol(rounds, print_progress)
        overhead = measure_overhead(rounds, WARM_PROCESS, print_progress)
        print_progress("fields of obstacles")
        fields = [run_speed.measure_field(count) for count in (209, 2090)]
        print_progress("the stack as an external process")
        external = measure_external(max(1, rounds // 2))
    figures = {**_patrol_figures(patrol), **overhead.figures, **_other_figures(fields, external)}
    lines = [*_patrol_lines(patrol, rounds), *_overhead_lines(overhead), *_field_lines(fields)]
    text = "\n".join([*lines, *_external_lines(external)])
    print_result(Result.on_this_machine(figures), text, _sections(patrol, overhead, fields, external), format_, before)


def _sections(
    patrol: "Patrol", overhead: "Overhead", fields: "list[Field]", external: "ExternalStackCost"
) -> dict[str, Any]:
    return {
        "patrol": {**asdict(patrol), "real_time_factor": patrol.factor, "ratio_to_bare": patrol.ratio},
        "overhead": asdict(overhead),
        "fields": [asdict(field) for field in fields],
        "external": {**asdict(external), "ratio": external.ratio},
    }


def _patrol_figures(patrol: "Patrol") -> Measurements:
    scale, unit = 1e3 / patrol.simulated, "ms a simulated second"
    return {
        "patrol, times PyBullet alone": Measurement.of(patrol.ratios, ""),
        "patrol": Measurement.of([scale * cpu for cpu in patrol.cpus], unit),
        "PyBullet alone": Measurement.of([scale * baseline for baseline in patrol.bares], unit),
        **{
            name: Measurement.of([scale * seconds for seconds in rounds], unit)
            for name, rounds in patrol.parted.items()
        },
    }


def _other_figures(fields: "list[Field]", external: "ExternalStackCost") -> Measurements:
    figures = dict[str, Measurement]()
    for field in fields:
        figures[f"scan among {field.obstacles} obstacles"] = Measurement(field.scan_ms, "ms")
        figures[f"step among {field.obstacles} obstacles"] = Measurement(field.step_us, "µs")
    return {**figures, "beat with the stack as a process": Measurement(external.there_us, "µs")}


def _patrol_lines(patrol: "Patrol", rounds: int) -> list[str]:
    width = max(map(len, patrol.parts))
    shares = sorted(patrol.parts.items(), key=lambda part: -part[1])
    ratio = f"{patrol.ratio:.2f} times the time of PyBullet alone for the same steps and scans"
    spread = f"{min(patrol.ratios):.2f} … {max(patrol.ratios):.2f} in single rounds"
    return [
        f"patrol of {patrol.simulated:g} s, all features, one core",
        f"  {patrol.factor:.0f} times real time ({patrol.cpu:.2f} s of CPU time, median of {rounds})",
        f"  {ratio} ({patrol.bare:.2f} s; {spread})",
        f"    {'':{width}}  share   ms a simulated second   times PyBullet alone",
        *(
            f"    {n:{width}} {s / patrol.cpu:6.1%} {1e3 * s / patrol.simulated:23.2f} {s / patrol.bare:22.2f}"
            for n, s in shares
        ),
    ]


def _overhead_lines(overhead: "Overhead") -> list[str]:
    width = max(map(len, overhead.figures))
    lines = [f"    {name:{width}} {figure.value:7.1f} {figure.unit}" for name, figure in overhead.figures.items()]
    return ["overhead of a run (CPU time unless noted otherwise)", *lines]


def _field_lines(fields: "list[Field]") -> list[str]:
    return [
        "a scan of 720 beams and a physics step among cylinders",
        "    obstacles      scan   PyBullet alone      step   PyBullet alone",
        *(
            f"    {f.obstacles:9} {f.scan_ms:6.2f} ms {f.bare_scan_ms:13.2f} ms"
            f" {f.step_us:6.0f} µs {f.bare_step_us:13.0f} µs"
            for f in fields
        ),
    ]


def _external_lines(external: "ExternalStackCost") -> list[str]:
    return [
        f"the stack of the patrol as an external process with all topics, {external.beats} cycles",
        f"    {external.there_us:.0f} µs per cycle; in process {external.here_us:.0f} µs ({external.ratio:.1f} times)",
    ]
