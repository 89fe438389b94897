"""`simscen plot`."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from simscen.cli.diagnostics import harmless, print_text
from simscen.cli.session.logs import log_file, said_of
from simscen.cli.session.output_files import save
from simscen.core.geometry import Pose2
from simscen.core.grid import UNKNOWN, OccupancyGrid
from simscen.record.replay import Log, invalid, read_run
from simscen.record.sceneryfile import scenery_of


def command(
    run: Annotated[Path, typer.Argument(help="The folder of a run, or its run.mcap.")],
    out: Annotated[Path | None, typer.Option(help="The picture (png); default: map.png beside the log.")] = None,
) -> None:
    """Draw a recorded run from its log alone.

    The map, zones, the true way, the belief, the plans, goals, doors, people, faults, and where each criterion was
    violated, in the world as it was. A log that broke off (run.partial.mcap) is drawn as far as it goes. Exit code 0;
    2: not a usable log, or the picture cannot be written.
    """
    file = log_file(run)
    log = read_run(file)
    picture = out or file.with_name("map.png")
    _draw(log, file, picture)
    print_text(harmless(str(picture)))


def _draw(log: Log, file: Path, picture: Path) -> None:
    from simscen.report.picture.compose import write_picture
    from simscen.report.picture.scene import Scene, with_robots

    try:
        scenery = scenery_of(log.about)
        map_ = scenery.map.grid if scenery.map else log.about.map or _nothing(log)
    except ValueError as error:
        raise invalid(file, "SC802", f"the log is damaged: {error}") from error
    scene = Scene(log.trace, log.about.case, map_, said_of(log, file), scenery)
    robots = {name: (one.trace, one.about.case) for name, one in log.robots.items()}
    save(picture, lambda path: write_picture(with_robots(scene, robots), path), [file])


def _nothing(log: Log) -> OccupancyGrid:
    """One unknown cell where the robot started, for a robot without a map."""
    start = log.about.case.start
    return OccupancyGrid(np.full((1, 1), UNKNOWN, dtype=np.int8), 0.05, Pose2(start.x, start.y))
