"""Command `simscen robot`, which checks a robot by test drives."""

import math
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from simscen.cli.diagnostics import as_json as problems_as_json
from simscen.cli.diagnostics import (
    as_text,
    escaped,
    paths_from_working_folder,
    print_text,
    relative_to_working_folder,
)
from simscen.cli.process import engine_output_on_stderr
from simscen.cli.session.user_files import save
from simscen.core.errors import Exit, InvalidInput
from simscen.loading.files.discovery import default_root
from simscen.loading.files.single_files import load_robot_file

if TYPE_CHECKING:
    from simscen.run.robot_check import DriveCheck, RobotCheckResult
    from simscen.run.robot_trials import Motion, Trial
    from simscen.sim.body.robot_body import RobotBody

app = typer.Typer(rich_markup_mode=None, add_completion=False, no_args_is_help=True)


@app.callback()
def _robot() -> None:
    """Drive a robot and compare command, odometry, and truth."""


@app.command()
def check(
    robot: Annotated[str, typer.Argument(help="A *.robot.yaml, .urdf or .xacro file, or the name of a shipped robot.")],
    picture: Annotated[Path | None, typer.Option(help="Draw the driven paths into this file (png).")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    root: Annotated[Path | None, typer.Option(help="Root folder; the robot may only refer to files below it.")] = None,
    world_path: Annotated[
        list[Path] | None, typer.Option(help="Additional folder with ROS packages or models; repeatable.")
    ] = None,
) -> None:
    """Drive a robot in an empty world and compare command, odometry, and truth.

    The robot rests for a second, drives 2 m straight, turns once on the spot (a car: on its smallest circle), drives a
    square, and moves sideways if it can. The odometry has no noise, so differences come from slip, skidding, and wrong
    dimensions. Dimensions that differ from the URDF, and wheels or casters off the ground, are warnings.

    Exit code 0: all checks passed; 1: a check failed; 2: the robot is unusable.
    """
    from simscen.loading.builders import robot_from_file
    from simscen.loading.checks.robot_geometry import geometry_warnings
    from simscen.run.robot_check import check_robot

    root_folder = root or default_root([Path(robot)])
    with paths_from_working_folder(root_folder):
        file = load_robot_file(robot, root_folder, world_path or ())
    library = file.library
    try:
        spec, body = robot_from_file(file.robot, file.roots)
        notes = library.with_source(geometry_warnings(file.robot, spec, body, file.roots))
        with engine_output_on_stderr():
            checked = check_robot(body)
    except InvalidInput as error:
        problems = library.with_source(error.problems)
        raise InvalidInput(relative_to_working_folder(problems, library.sandbox.root)) from error
    notes = relative_to_working_folder(notes, library.sandbox.root)
    if as_json:
        print(problems_as_json(notes, **as_data(body, checked)))
    else:
        print_text("\n".join([escaped(f"{body.name} · {robot}"), *as_table(body, checked)]))
        if notes:
            print_text(as_text(notes))
    if picture is not None:
        from simscen.report.picture.drive_plots import draw_drives

        panels = [(t.name, t.command.path, t.odometry.path, t.truth.path) for t in checked.trials]
        image = draw_drives(body.name, panels, body.footprint)
        save(picture, lambda path: image.save(path, format="PNG"), [file.robot.path])
    if checked.failed_count:
        sys.exit(Exit.FAILED)


def as_table(body: "RobotBody", checked: "RobotCheckResult") -> Iterator[str]:
    """Yield the lines of the table: the test drives, and then each check with its value and limit."""
    drive = body.drive.type.replace("_", " ")
    yield f"  {drive}, {body.mass:.4g} kg, {len(body.wheels)} wheels"
    slope, step = checked.climb
    if slope:
        yield f"  climbs {math.degrees(slope):.1f}° and a step of {1000 * step:.0f} mm, on dry concrete (calculated)"
    yield ""
    yield f"  {'':9}{'driven in m':^24}{'turned in degrees':^25}  odometry   most"
    yield f"  {'':9}{'command odometry   truth'}  {'command odometry  truth'}  off at end  tilt"
    yield from map(_drive_line, checked.trials)
    yield ""
    yield from map(_check_line, checked.checks)
    yield ""
    yield (
        f"{checked.failed_count} of {len(checked.checks)} checks failed"
        if checked.failed_count
        else f"all {len(checked.checks)} checks passed"
    )


def _drive_line(trial: "Trial") -> str:
    motions = (trial.command, trial.odometry, trial.truth)
    driven = " ".join(f"{motion.distance:7.3f}" for motion in motions)
    angles = (round(math.degrees(motion.angle), 1) + 0.0 for motion in motions)  # + 0.0 turns -0.0 into 0.0
    turned = " ".join(f"{angle:7.1f}" for angle in angles)
    gap = trial.odometry.end.distance(trial.truth.end)
    return f"  {trial.name:9} {driven}  {turned}   {gap:7.3f} m  {math.degrees(trial.tilt):4.1f}"


def _check_line(check: "DriveCheck") -> str:
    """Return the line of one check; after a failed check, also a line with its advice."""
    verdict = "ok" if check.passed else "FAILED"
    line = f"  {verdict:7} {check.name:41} {check.value:9.3f}, at most {check.limit:.3g} {check.unit}"
    return line if check.passed or not check.advice else f"{line}\n          {check.advice}"


def as_data(body: "RobotBody", checked: "RobotCheckResult") -> dict[str, Any]:
    """Return all values as JSON data. Angles are in rad and lengths in m, except in a check with another `unit`."""
    return {
        "robot": body.name,
        "drive": body.drive.type,
        "passed": not checked.failed_count,
        "climb": {"slope": checked.climb.slope, "step": checked.climb.step},
        "rest": asdict(checked.rest),
        "trials": [
            {
                "name": trial.name,
                "command": _motion_data(trial.command),
                "odometry": _motion_data(trial.odometry),
                "truth": _motion_data(trial.truth),
                "tilt": trial.tilt,
            }
            for trial in checked.trials
        ],
        "checks": [{**asdict(check), "held": check.passed} for check in checked.checks],
    }


def _motion_data(motion: "Motion") -> dict[str, Any]:
    return {"driven": motion.distance, "turned": motion.angle, "end": motion.end._asdict()}
