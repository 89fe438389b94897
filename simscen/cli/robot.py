"""`simscen robot`: does a robot drive as its file says?"""

import sys
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.diagnostics import as_json as problems_as_json
from simscen.cli.diagnostics import as_text, from_here, harmless, print_text
from simscen.cli.outputs import save
from simscen.core.errors import Exit, InvalidInput
from simscen.loading.discovery import default_root
from simscen.loading.robotfile import RobotFile, load_robot_file

app = typer.Typer(rich_markup_mode=None, add_completion=False, no_args_is_help=True)


@app.callback()
def _robot() -> None:
    """Drive a robot once and compare command, odometry and truth."""


@app.command()
def check(
    robot: Annotated[str, typer.Argument(help="A *.robot.yaml, .urdf or .xacro file, or the name of a shipped robot.")],
    picture: Annotated[Path | None, typer.Option(help="Draw the ways that were driven (png).")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    root: Annotated[Path | None, typer.Option(help="Files that the robot names stay in this folder.")] = None,
    world_path: Annotated[
        list[Path] | None, typer.Option(help="Folder with ROS packages or models; repeatable.")
    ] = None,
) -> None:
    """Drive a robot once in an empty world, and compare what it was told, what its encoders say and what is true.

    It rests for a second, drives 2 m straight, turns once on the spot (a car: its smallest circle), drives a square,
    and sideways if it can. Odometry is without noise: what differs is slip, skidding and wrong dimensions. Dimensions
    that differ from those of the URDF, and wheels and casters that it draws off the ground, are warnings.

    Exit code 0: every check held; 1: one did not; 2: the robot cannot be used.
    """
    file = load_robot_file(robot, root or default_root([Path(robot)]), world_path or ())
    home = file.library.fence.root
    try:
        failed = _checked(file, robot, picture, as_json)
    except InvalidInput as error:
        raise InvalidInput(from_here(file.library.with_source_where_missing(error.problems), home)) from error
    if failed:
        sys.exit(Exit.FAILED)


def _checked(file: RobotFile, named: str, picture: Path | None, as_json: bool) -> int:
    from simscen.cli.quiet import engine_output_on_stderr
    from simscen.cli.robottext import as_data, as_table
    from simscen.run.robotcheck import check_robot
    from simscen.run.robotgeometry import geometry_notes
    from simscen.run.worldsource import robot_of

    spec, body = robot_of(file.robot, file.roots)
    library = file.library
    notes = library.with_source_where_missing(geometry_notes(file.robot, spec, body, file.roots))
    notes = from_here(notes, library.fence.root)
    with engine_output_on_stderr():
        checked = check_robot(body)
    if as_json:
        print(problems_as_json(notes, **as_data(body, checked)))
    else:
        print_text("\n".join([harmless(f"{body.name} · {named}"), *as_table(body, checked)]))
        if notes:
            print_text(as_text(notes))
    if picture is not None:
        from simscen.report.picture.drives import draw_drives

        panels = [(t.name, t.command.path, t.odometry.path, t.truth.path) for t in checked.trials]
        image = draw_drives(body.name, panels, body.footprint)
        save(picture, lambda path: image.save(path, format="PNG"), [file.robot.path])
    return checked.failed
