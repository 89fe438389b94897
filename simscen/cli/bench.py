"""`simscen bench`: how fast it is; `bench worlds`: also in large worlds; `bench nav`: how well the stack drives;
`bench localization`: how well it knows where it is.
"""

import json
from dataclasses import asdict
from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.cli import bench_localization, bench_nav, bench_worlds
from simscen.cli.diagnostics import print_text

if TYPE_CHECKING:
    from simscen.run.bench import Field, Patrol
    from simscen.run.bench_external import External

app = typer.Typer(rich_markup_mode=None, add_completion=False)
app.command("nav")(bench_nav.command)
app.command("localization")(bench_localization.command)
app.command("worlds")(bench_worlds.command)


class Format(str, Enum):
    """What is printed."""

    TEXT = "text"
    JSON = "json"


@app.callback(invoke_without_command=True)
def command(
    ctx: typer.Context,
    format_: Annotated[Format, typer.Option("--format", help="What to print.")] = Format.TEXT,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Runs of the patrol; the median counts.")] = 5,
) -> None:
    """Measure how fast simscen runs here.

    A patrol of 60 s with everything on (240 Hz physics, 360 beams at 10 Hz, 500 to 2000 particles, full MCAP log) on
    one core: times real time, where the time goes, and how long PyBullet alone takes to step and scan as often. Then a
    720-beam scan and a step in two fields of obstacles, beside PyBullet with one body for each. These are CPU times.
    Last the patrol with its stack behind the stack protocol: µs of wall time that the engine waits for it at each beat.
    """
    if ctx.invoked_subcommand is not None:
        return
    from simscen.cli.quiet import engine_output_on_stderr

    with engine_output_on_stderr():
        from simscen.run import bench
        from simscen.run.bench_external import measure_external

        patrol = bench.measure_patrol(rounds)
        fields = [bench.measure_field(count) for count in (209, 2090)]
        external = measure_external(max(1, rounds // 2))
    if format_ is Format.JSON:
        patrol_data = {**asdict(patrol), "real_time_factor": patrol.factor, "ratio_to_bare": patrol.cpu / patrol.bare}
        external_data = {**asdict(external), "ratio": external.ratio}
        fields_data = [asdict(field) for field in fields]
        print(json.dumps({"patrol": patrol_data, "fields": fields_data, "external": external_data}, indent=2))
        return
    print_text("\n".join([*_patrol_lines(patrol, rounds), *_field_lines(fields), *_external_lines(external)]))


def _patrol_lines(patrol: "Patrol", rounds: int) -> list[str]:
    width = max(map(len, patrol.parts))
    shares = sorted(patrol.parts.items(), key=lambda part: -part[1])
    ratio = f"{patrol.cpu / patrol.bare:.1f} times what PyBullet alone takes to step and scan as often"
    return [
        f"patrol of {patrol.simulated:g} s, everything on, one core",
        f"  {patrol.factor:.0f} times real time ({patrol.cpu:.2f} s of CPU time, median of {rounds})",
        f"  {ratio} ({patrol.bare:.2f} s)",
        *(f"    {n:{width}} {s / patrol.cpu:6.1%} {1e3 * s / patrol.simulated:6.2f} ms a second" for n, s in shares),
    ]


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


def _external_lines(external: "External") -> list[str]:
    return [
        f"the stack of the patrol as a process of its own, all it hears and says in full, {external.beats} beats",
        f"    {external.there_us:.0f} µs a beat; in the engine {external.here_us:.0f} µs ({external.ratio:.1f} times)",
    ]
