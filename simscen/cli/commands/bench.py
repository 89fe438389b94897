"""Command `simscen bench`, which measures speed; its subcommands also measure navigation and localization."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.cli.benchmarks import localization, navigation, results, speed
from simscen.cli.benchmarks.results import CompareOption, FormatOption, print_progress, print_result, read_result
from simscen.cli.process import engine_output_on_stderr
from simscen.cli.shared_options import TextOrJson

if TYPE_CHECKING:
    from simscen.bench.speed.run_overhead import ExternalStackCost, Overhead
    from simscen.bench.speed.run_speed import ObstacleFieldTimes, PatrolTimes

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
    format_: FormatOption = TextOrJson.TEXT,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Number of runs of the patrol; the median is used.")] = 5,
    compare: CompareOption = None,
) -> None:
    """Measure speed, navigation, and localization.

    Without a subcommand, simulates a patrol of 60 s on one core with all features enabled: 240 Hz physics, 360 beams at
    10 Hz, 500 to 2000 particles, and a full MCAP log. Prints:

    - the speed relative to real time, and to PyBullet alone with the same steps and scans

    - the share of CPU time of each part of the simulation

    - the overhead of a run: setup and verdicts, its process, preparing a scenario, the start of a session, and memory

    - the time of a scan of 720 beams, and of a physics step among obstacles, compared with PyBullet

    - the CPU time of `simscen validate`, and the wall time per cycle for which a run waits for an external stack

    All times are CPU times unless the output says otherwise. Takes less than a minute on an idle machine; the
    subcommands take longer. --compare compares the result with an earlier result of --format json, and the subcommand
    `compare` compares two such results.
    """
    if ctx.invoked_subcommand is not None:
        return
    from simscen.cli.session.fork_server_start import FORK_SERVER

    before = None if compare is None else read_result(compare)
    with engine_output_on_stderr():
        from simscen.bench.speed import run_speed
        from simscen.bench.speed.run_overhead import measure_external, measure_overhead

        patrol = run_speed.measure_patrol(rounds, print_progress)
        overhead = measure_overhead(rounds, FORK_SERVER, print_progress)
        print_progress("fields of obstacles")
        fields = [run_speed.measure_obstacle_field(count) for count in (209, 2090)]
        print_progress("the stack as an external process")
        external = measure_external(max(1, rounds // 2))
    figures = {**_patrol_figures(patrol), **overhead.figures}
    for field in fields:
        figures[f"scan among {field.obstacles} obstacles"] = Measurement(field.scan_ms, "ms")
        figures[f"step among {field.obstacles} obstacles"] = Measurement(field.step_us, "µs")
    figures["cycle with the stack as a process"] = Measurement(external.external_us, "µs")
    sections = {
        "patrol": {**asdict(patrol), "real_time_factor": patrol.real_time_factor, "ratio_to_bare": patrol.ratio},
        "overhead": asdict(overhead),
        "fields": [asdict(field) for field in fields],
        "external": {**asdict(external), "ratio": external.ratio},
    }
    text = "\n".join([*_patrol_lines(patrol, rounds), *_other_lines(overhead, fields, external)])
    print_result(figures, text, sections, format_, before)


def _patrol_figures(patrol: "PatrolTimes") -> Measurements:
    rounds = {"patrol": patrol.cpu_rounds, "PyBullet alone": patrol.baseline_rounds, **patrol.part_rounds}
    scale, unit = 1e3 / patrol.simulated, "ms per simulated second"
    return {
        "patrol, times PyBullet alone": Measurement.from_rounds(patrol.ratios, ""),
        **{
            name: Measurement.from_rounds([scale * seconds for seconds in times], unit)
            for name, times in rounds.items()
        },
    }


def _patrol_lines(patrol: "PatrolTimes", rounds: int) -> list[str]:
    width = max(map(len, patrol.parts))
    shares = sorted(patrol.parts.items(), key=lambda part: -part[1])
    ratio = f"{patrol.ratio:.2f} times the time of PyBullet alone for the same steps and scans"
    spread = f"{min(patrol.ratios):.2f} … {max(patrol.ratios):.2f} in single rounds"
    return [
        f"patrol of {patrol.simulated:g} s, all features, one core",
        f"  {patrol.real_time_factor:.0f} times real time ({patrol.cpu:.2f} s of CPU time, median of {rounds})",
        f"  {ratio} ({patrol.baseline:.2f} s; {spread})",
        f"    {'':{width}}  share   ms per simulated second   times PyBullet alone",
        *(
            f"    {n:{width}} {s / patrol.cpu:6.1%} {1e3 * s / patrol.simulated:25.2f} {s / patrol.baseline:22.2f}"
            for n, s in shares
        ),
    ]


def _other_lines(overhead: "Overhead", fields: "list[ObstacleFieldTimes]", external: "ExternalStackCost") -> list[str]:
    """Return the lines about the overhead of a run, the fields of obstacles, and the external stack."""
    width = max(map(len, overhead.figures))
    return [
        "overhead of a run (CPU time unless noted otherwise)",
        *(f"    {name:{width}} {figure.value:7.1f} {figure.unit}" for name, figure in overhead.figures.items()),
        "a scan of 720 beams and a physics step among cylinders",
        "    obstacles      scan   PyBullet alone      step   PyBullet alone",
        *(
            f"    {f.obstacles:9} {f.scan_ms:6.2f} ms {f.baseline_scan_ms:13.2f} ms"
            f" {f.step_us:6.0f} µs {f.baseline_step_us:13.0f} µs"
            for f in fields
        ),
        f"the stack of the patrol as an external process with all topics, {external.cycles} cycles",
        f"    {external.external_us:.0f} µs of wall time per cycle; "
        f"in process {external.in_process_us:.0f} µs ({external.ratio:.1f} times)",
    ]
