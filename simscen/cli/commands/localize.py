"""Command `simscen localize`, which runs a localizer on a recorded drive."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from simscen.bench.localization.log_evaluation import LocalizationResult, PoseErrors, compare_with_reference, localize
from simscen.cli.diagnostics import escaped, paths_from_working_folder, print_text
from simscen.cli.session.user_files import save
from simscen.core.errors import InvalidInput, Problem, UsageError
from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Estimate
from simscen.core.random_streams import MAX_SEED
from simscen.loading.files.criteria_file import load_criteria
from simscen.loading.files.discovery import default_root
from simscen.loading.files.single_files import load_robot_file, load_world_file
from simscen.loading.loaded import LoadedMap
from simscen.loading.yaml.tree import value_position
from simscen.model.stack import StackSpec
from simscen.record.localization_logs.read import LocalizationLog, read_localization_log
from simscen.record.localization_logs.rows import TICK_RATE_HZ
from simscen.report.display_text import number_with_noun
from simscen.stack.protocols import RobotModel, Surroundings

MIN_COMPARED_FRACTION = 0.99
"""Fraction of compared beliefs (pose estimates) below which the output states the fraction."""


def command(
    log: Annotated[Path, typer.Argument(help="An MCAP file, a rosbag2 folder, a CARMEN .log or a .csv.")],
    map_: Annotated[Path, typer.Option("--map", help="The ROS map (yaml) of the robot.")],
    robot: Annotated[str, typer.Option(help="A robot file, or the name of a shipped robot.")],
    scenario: Annotated[
        Path | None,
        typer.Option(
            help="Scenario, or file for `simscen judge --scenario`, with a `stack:`; default: the default stack."
        ),
    ] = None,
    reference: Annotated[
        str | None,
        typer.Option(
            help="Topic of the reference pose, or two /tf frames such as map:base_link; default: the truth in the log."
        ),
    ] = None,
    odom: Annotated[
        str, typer.Option(help="Topic of the odometry, or two frames of /tf such as odom:base_link.")
    ] = "/odom",
    scan: Annotated[str, typer.Option(help="Topic of the scans.")] = "/scan",
    start: Annotated[
        str | None,
        typer.Option(help="X,Y,YAW in m and rad, or `unknown`; default: from the reference, else /initialpose."),
    ] = None,
    lost: Annotated[float, typer.Option(min=0.01, help="Error in meters above which the robot counts as lost.")] = 1.0,
    seed: Annotated[int, typer.Option(min=1, max=MAX_SEED, help="Seed of the localizer.")] = 1,
    picture: Annotated[Path | None, typer.Option(help="Draw map, belief, and reference into this file (png).")] = None,
    root: Annotated[
        Path | None, typer.Option(help="Root folder; the other files may only refer to files below it.")
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print JSON: the figures and the error over time.")] = False,
) -> None:
    """Run a localizer on a recorded drive and compare its belief with a reference.

    Use this to tune AMCL for your own building: nothing is simulated, and the same log and seed give the same figures.
    A CSV file has the rows `odom,TIME,X,Y,YAW`, `scan,TIME,ANGLE_MIN,ANGLE_INCREMENT,RANGE_MIN,RANGE_MAX,R0,R1,…`,
    `truth,TIME,X,Y,YAW`, and, before the scans, `mount,X,Y,YAW` for the pose of the lidar on the robot.

    Exit code 0: the log was processed, independently of the figures; 2: an input is unusable.
    """
    from simscen.loading.builders import load_map

    log_data = read_localization_log(log, odom, scan, reference)
    spec, map_file, model = _load_inputs(scenario, map_, robot, root)
    grid = load_map(map_file).refined(spec.costmap.resolution)
    estimate = _estimate(start, log_data)
    localized = localize(log_data, spec, Surroundings(model, grid, TICK_RATE_HZ), estimate, seed)
    errors = compare_with_reference(localized, log_data, lost)
    for note in log_data.notes:
        print_text(f"note: {escaped(note)}", sys.stderr)
    if picture is not None:
        from simscen.report.picture.drive_plots import write_localization_picture

        positions, truth = localized.poses[:, :2], log_data.truth[:, :2]
        inputs = [log, map_, map_file.image]
        save(picture, lambda path: write_localization_picture(grid, positions, truth, path), inputs)
    cpu_ms = localized.cpu_s * 1e3 / max(1, localized.scan_count)
    print_text(f"{cpu_ms:.2f} ms of CPU time per scan", sys.stderr)
    if json_:
        print(json.dumps(_document(localized, errors, seed), sort_keys=True, indent=2, allow_nan=False))
    else:
        for line in _lines(localized, errors, lost):
            print_text(escaped(line))


def _load_inputs(
    scenario: Path | None, map_: Path, robot: str, root: Path | None
) -> tuple[StackSpec, LoadedMap, RobotModel]:
    """Return the stack of the scenario, the map, and the robot. Raises InvalidInput."""
    from simscen.loading.builders import robot_from_file
    from simscen.run.robot_interface import robot_model

    spec = StackSpec()
    if scenario is not None:
        root_folder = root or default_root([scenario])
        with paths_from_working_folder(root_folder):
            criteria = load_criteria(scenario, root_folder)
            if not isinstance(criteria.spec.stack, StackSpec):
                position = value_position(criteria.tree, ("stack",))
                hint = "name a file whose `stack` is simscen's own"
                problem = Problem(*position, "SC016", "this stack has no simscen localizer", hint)
                raise InvalidInput(criteria.library.with_source([problem]))
        spec = criteria.spec.stack
    root_folder = root or default_root([map_])
    with paths_from_working_folder(root_folder):
        world = load_world_file(map_, root_folder)
    if world.map is None:
        hint = "write one with `simscen world export`"
        raise InvalidInput([Problem(str(map_), 0, 0, "SC320", "not a ROS map", hint)])
    root_folder = root or default_root([Path(robot)])
    with paths_from_working_folder(root_folder):
        file = load_robot_file(robot, root_folder)
        body = robot_from_file(file.robot, file.roots)[1]
    return spec, world.map, robot_model(body)


def _estimate(start: str | None, log_data: LocalizationLog) -> Estimate:
    """Return the initial pose estimate from --start or from the log. Raises UsageError if there is none."""
    if start == "unknown":
        return Estimate(None)
    if start is None:
        if log_data.initial_pose is None:
            raise UsageError("the log has no initial pose; use --start X,Y,YAW or --start unknown")
        return Estimate(log_data.initial_pose)
    try:
        x, y, yaw = (float(part) for part in start.split(","))
    except ValueError as error:
        raise UsageError(f"cannot read --start {escaped(start)}: expected X,Y,YAW or unknown") from error
    if not all(abs(value) < 1e6 for value in (x, y, yaw)):
        raise UsageError(f"cannot read --start {escaped(start)}: the values are out of range")
    return Estimate(Pose2(x, y, yaw))


def _lines(localized: LocalizationResult, errors: PoseErrors | None, lost_distance: float) -> list[str]:
    """Return the printed lines. `lost_distance` is the error in m above which the robot counts as lost."""
    x, y, yaw = localized.poses[-1].tolist()
    seconds = localized.times[-1] - localized.times[0]
    scans = number_with_noun(localized.scan_count, "scan")
    lines = [f"{scans} in {seconds:.1f} s; final belief ({x:.2f}, {y:.2f}, {yaw:.3f})"]
    if errors is None:
        return [*lines, "no reference to compare with"]
    figures = errors.figures()
    distances = ", ".join(f"{name} {figures[name]:.3f} m" for name in ("median", "rmse", "max", "final"))
    lines += [f"error: {distances}", f"heading: rmse {figures['yaw_rmse']:.4f} rad"]
    if errors.compared_fraction < MIN_COMPARED_FRACTION:
        lines.append(f"compared with the reference: {errors.compared_fraction:.1%} of the beliefs")
    for interval in errors.lost:
        end = "to the end" if interval.until is None else f"to {interval.until:.1f} s"
        lines.append(f"lost (more than {lost_distance:g} m off) from {interval.since:.1f} s {end}")
    restriction = "" if errors.compared_fraction >= MIN_COMPARED_FRACTION else ", as far as compared"
    return lines if errors.lost else [*lines, f"never lost (more than {lost_distance:g} m off){restriction}"]


def _document(localized: LocalizationResult, errors: PoseErrors | None, seed: int) -> dict[str, object]:
    document: dict[str, object] = {"scans": localized.scan_count, "seed": seed, "end": localized.poses[-1].tolist()}
    if errors is None:
        return document | {"error": None}
    columns = (errors.times.tolist(), errors.distance.tolist(), errors.yaw.tolist())
    return document | {
        "error": errors.figures(),
        "compared": errors.compared_fraction,
        "error_over_time": list(zip(*columns, strict=True)),
        "lost": [{"since": interval.since, "until": interval.until} for interval in errors.lost],
    }
