"""`simscen bench worlds`: what a simulated second costs in large worlds."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from simscen.cli.diagnostics import print_text

if TYPE_CHECKING:
    from simscen.run.benchworlds import Cost


def command(
    as_json: Annotated[bool, typer.Option("--json", help="Print all numbers as JSON.")] = False,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Runs in each world; the median counts.")] = 3,
) -> None:
    """Measure what a simulated second costs in large worlds.

    The patrol of a house, a generated hall with 40 movable meshes, and a generated ROS map of 100 x 100 m with 400
    blocks and noise: at most 60 s each with everything on, CPU time of one core, as multiples of the house.
    """
    from simscen.cli.quiet import engine_output_on_stderr

    with engine_output_on_stderr():
        from simscen.run.benchworlds import measure_worlds

        costs = list(measure_worlds(rounds))
    print_text(json.dumps([asdict(cost) for cost in costs], indent=2) if as_json else as_text(costs))


def as_text(costs: "Sequence[Cost]") -> str:
    """A line for each world; the first is what the others are held against."""
    width = max(len(cost.name) for cost in costs)
    lines = [f"{'':{width}}  triangles  movable  CPU a second   ratio  preparing   memory"]
    lines += [
        f"{c.name:{width}}  {c.triangles:9}  {c.movable:7}  {c.milliseconds:9.1f} ms"
        f"  {c.milliseconds / costs[0].milliseconds:6.2f}  {c.preparing:7.2f} s  {c.memory:4.0f} MB"
        for c in costs
    ]
    return "\n".join(lines)
