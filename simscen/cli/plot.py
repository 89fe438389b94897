"""`simscen plot`."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from simscen.cli.diagnostics import harmless, print_text
from simscen.cli.outputs import save
from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose2
from simscen.core.grid import UNKNOWN, OccupancyGrid
from simscen.core.problems import Problem
from simscen.core.result import RunResult
from simscen.judge.result import result_of
from simscen.judge.resultdata import from_json
from simscen.judge.several import together
from simscen.loading.resolved import criteria_of_text
from simscen.record.replay import Log, invalid, read_run
from simscen.record.sceneryfile import scenery_of

LOGS = ("run.mcap", "run.partial.mcap")


def command(
    run: Annotated[Path, typer.Argument(help="The folder of a run, or its run.mcap.")],
    out: Annotated[Path | None, typer.Option(help="The picture (png); default: map.png beside the log.")] = None,
) -> None:
    """Draw a recorded run from its log alone.

    The map, zones, the true way, the belief, the plans, goals, doors, people, faults, and where each criterion was
    violated, in the world as it was. A log that broke off (run.partial.mcap) is drawn as far as it goes. Exit code 0;
    2: not a usable log, or the picture cannot be written.
    """
    file = _log(run)
    log = read_run(file)
    picture = out or file.with_name("map.png")
    _draw(log, file, picture)
    print_text(harmless(str(picture)))


def _log(run: Path) -> Path:
    """The log itself. Raises InvalidInput when a folder holds none."""
    if not run.is_dir():
        return run
    found = [run / name for name in LOGS if (run / name).is_file()]
    if not found:
        hint = "name the folder of one run, e.g. simscen-out/latest/runs/SCENARIO/seed-1"
        raise InvalidInput([Problem(str(run), 0, 0, "SC800", f"there is no {LOGS[0]} in it", hint)])
    return found[0]


def _draw(log: Log, file: Path, picture: Path) -> None:
    from simscen.report.picture import Scene, with_robots, write_picture

    try:
        scenery = scenery_of(log.about)
        map_ = scenery.map.grid if scenery.map else log.about.map or _nothing(log)
    except ValueError as error:
        raise invalid(file, "SC802", f"the log is damaged: {error}") from error
    scene = Scene(log.trace, log.about.case, map_, _result(log, file), scenery)
    robots = {name: (one.trace, one.about.case) for name, one in log.robots.items()}
    save(picture, lambda path: write_picture(with_robots(scene, robots), path), [file])


def _result(log: Log, file: Path) -> RunResult:
    """What the run said of itself; for one that broke off, what its criteria say of what there is."""
    if log.result:
        return from_json(log.result)
    results = {name: _judged(one, file, name) for name, one in (log.robots or {"": log}).items()}
    traces = {name: one.trace for name, one in log.robots.items()}
    return together(results, traces) if traces else results[""]


def _judged(log: Log, file: Path, robot: str) -> RunResult:
    about = log.about
    spec = criteria_of_text(about.scenario, str(file), about.facts, robot)
    return result_of(about.key, about.name, spec.pass_, log.trace, about.case, metrics=spec.metrics)


def _nothing(log: Log) -> OccupancyGrid:
    """One unknown cell where the robot started, for a robot without a map."""
    start = log.about.case.start
    return OccupancyGrid(np.full((1, 1), UNKNOWN, dtype=np.int8), 0.05, Pose2(start.x, start.y))
