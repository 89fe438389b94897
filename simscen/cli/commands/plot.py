"""Command `simscen plot`, which draws a recorded run as a picture."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from simscen.cli.diagnostics import escaped, print_text
from simscen.cli.session.logs import log_file, recorded_result
from simscen.cli.session.user_files import save
from simscen.core.environment.occupancy_grid import UNKNOWN, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.record.log_header import scenery_from_header
from simscen.record.log_reader import invalid_log, read_run


def command(
    run: Annotated[Path, typer.Argument(help="The folder of a run, or its run.mcap.")],
    out: Annotated[Path | None, typer.Option(help="Output file (png); default: map.png beside the log.")] = None,
) -> None:
    """Draw a recorded run as a picture.

    The picture shows the map, zones, true path, belief, plans, goals, doors, pedestrians, faults, and the positions
    at which criteria were violated. A truncated log (run.partial.mcap) is drawn up to its end. Exit code 0: drawn; 2:
    the log is unusable, or the picture cannot be written.
    """
    from simscen.report.picture.map_picture import write_picture
    from simscen.report.picture.scene import Scene, scene_with_robots

    file = log_file(run)
    log = read_run(file)
    start = log.header.case.start
    unknown_map = OccupancyGrid(np.full((1, 1), UNKNOWN, dtype=np.int8), 0.05, Pose2(start.x, start.y))
    try:
        scenery = scenery_from_header(log.header)
        map_ = scenery.map.grid if scenery.map else log.header.map or unknown_map
    except ValueError as error:
        raise invalid_log(file, "SC802", f"the log is damaged: {error}") from error
    scene = Scene(log.trace, log.header.case, map_, recorded_result(log, file), scenery)
    robots = {name: (robot_log.trace, robot_log.header.case) for name, robot_log in log.robots.items()}
    picture = out or file.with_name("map.png")
    save(picture, lambda path: write_picture(scene_with_robots(scene, robots), path), [file])
    print_text(escaped(str(picture)))
