"""Chooses world, map, robot, and stack from the user's options, the log header, or the messages, in this order."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput, Problem, UsageError
from simscen.loading.builders import load_map, world_from_file
from simscen.loading.files.discovery import default_root
from simscen.loading.files.single_files import load_world_file
from simscen.model.world import WorldSpec
from simscen.reconstruction.compared_scans import compare_scans
from simscen.reconstruction.drive.gaps import scans_with_pose
from simscen.reconstruction.drive.recorded_drive import RecordedDrive
from simscen.reconstruction.drive.run_description import RunDescription
from simscen.reconstruction.reasons import Reason
from simscen.reconstruction.scenario.contents import GivenParts
from simscen.reconstruction.scenario.robot_file import TYPICAL_ROBOT, observed_limits, write_robot_file
from simscen.reconstruction.static_world import StaticWorld, map_from_scans, world_from_map
from simscen.worlds.maps.ros_map import save_map
from simscen.worlds.world_file import world_from_spec

WALL_MARGIN_M = 0.05
"""Maximum distance between a wall and the center of its map cell."""
NOISE_SCANS = 100
"""Minimum number of scans from which the noise of a lidar is computed. At most twice as many scans are used."""
MAX_EQUAL_MAP_DIFFERENCE = 0.002
"""Maximum fraction of different cells in two maps of the same world."""


@dataclass(frozen=True)
class GivenFiles:
    """World, map, and robot from the user's options. They replace those of the log.

    `robot` is a robot file, the name of a shipped robot, or the name of a robot in the log; "" for none.
    """

    world: Path | None = None
    map: Path | None = None
    robot: str = ""


class NewFiles:
    """Files written next to the scenario, in order, which are removed again if the reconstruction fails."""

    def __init__(self) -> None:
        self.paths: list[Path] = []

    def add(self, *files: Path) -> None:
        """Add files before they are written. Raises UsageError if one exists."""
        for file in files:
            if file.exists():
                raise UsageError(f"{file} already exists; choose another name for the scenario, or remove the file")
        self.paths += files

    def remove(self) -> None:
        """Remove all files."""
        for file in self.paths:
            file.unlink(missing_ok=True)


@dataclass
class WorldChoice:
    """World and map of the scenario, with reasons.

    `written` and `map` are the values of the keys `world` and `map` in the scenario. `is_built` states that the walls
    were built from the scans. `unknowns` are phrases about missing information.
    """

    written: str | Mapping[str, Any]
    world: World
    reason: Reason
    map: str = ""
    map_reason: Reason | None = None
    is_built: bool = False
    unknowns: list[str] = field(default_factory=list)


def choose_world(
    drive: RecordedDrive, described: RunDescription, files: GivenFiles, out: Path, new: NewFiles
) -> WorldChoice:
    """Return the world and the map for the scenario file `out`, and write world and map files next to `out`.

    The written files are added to `new`. Raises InvalidInput for an unusable file, UsageError if a file to write
    exists, and OSError if it cannot be written.
    """
    if files.world is not None:
        choice = _world_of_file(files.world, out, Reason("given with --world"), new)
    elif isinstance(described.world, Path):
        choice = _world_of_file(described.world, out, Reason("world file in the header of the log"), new)
    elif isinstance(described.world, Mapping):
        spec = WorldSpec.model_validate(described.world)
        world = world_from_spec(spec, spec.name or "world")
        choice = WorldChoice(described.world, world, Reason("walls and obstacles in the header of the log"))
    else:
        return _world_of_map(drive, files, out, new)
    if not described.has_map:
        choice.map, choice.map_reason = "none", Reason("the log has no map")
    elif files.map is not None:
        choice.map, choice.map_reason = relative_path(files.map, out), Reason("given with --map")
    elif drive.map is not None and _differs(drive.map, StaticWorld(choice.world, drive.lidar_height).grid):
        file = _write_map(drive.map, out.with_name(f"{scenario_stem(out)}_map.yaml"), new)
        choice.map, choice.map_reason = file.name, Reason("the map on /map differs from the world", 0.0)
    return choice


def _write_map(grid: OccupancyGrid, file: Path, new: NewFiles) -> Path:
    new.add(file, file.with_suffix(".pgm"))
    save_map(grid, file)
    return file


def _world_of_map(drive: RecordedDrive, files: GivenFiles, out: Path, new: NewFiles) -> WorldChoice:
    """Return a world with the walls of the given map, of the map in the log, or of a map built from the scans."""
    if files.map is not None:
        loaded = load_world_file(files.map, default_root([files.map]))
        if loaded.map is None:
            raise InvalidInput(
                [Problem(str(files.map), 0, 0, "SC320", "not a ROS map", "use --world for other worlds")]
            )
        grid, written = load_map(loaded.map), relative_path(files.map, out)
        return WorldChoice(written, world_from_map(grid, scenario_stem(out)), Reason("given with --map"))
    unknowns = ["walls and objects that no scan shows"]
    if drive.map is not None:
        grid, reason = drive.map, Reason("the walls are the occupied cells of /map", 0.0)
    else:
        grid = map_from_scans(drive)
        reason = Reason("built from the scans along the poses, because the log has no map", None, None, "medium")
        unknowns.append("which parts of the built map were on the robot's own map")
    file = _write_map(grid, out.with_name(f"{scenario_stem(out)}_map.yaml"), new)
    return WorldChoice(
        file.name,
        world_from_map(grid, scenario_stem(out)),
        reason,
        is_built=drive.map is None,
        unknowns=unknowns,
    )


def _world_of_file(file: Path, out: Path, reason: Reason, new: NewFiles) -> WorldChoice:
    """Return the world in `file`, and copy the file next to `out` if it is outside of the scenario's root folder."""
    root = default_root([file])
    loaded = load_world_file(file, root)
    out_root = default_root([out])
    written = relative_path(file, out)
    if not file.resolve().is_relative_to(out_root.resolve()):
        copy = out.with_name(f"{scenario_stem(out)}{''.join(file.suffixes[-2:])}")
        if loaded.map is not None:
            _write_map(load_map(loaded.map), copy, new)
        else:
            new.add(copy)
            shutil.copyfile(file, copy)
        written = copy.name
    return WorldChoice(written, world_from_file(loaded, root), reason)


def _differs(given: OccupancyGrid, drawn: OccupancyGrid) -> bool:
    """Return whether the map `given` to the robot and the map `drawn` from the world have different walls."""
    if given.shape != drawn.shape or given.origin.distance(drawn.origin) > 1e-6:
        return True
    return float(np.mean((given.cells > 50) != (drawn.cells > 50))) > MAX_EQUAL_MAP_DIFFERENCE


def prepare_given_parts(
    drive: RecordedDrive,
    described: RunDescription,
    choice: WorldChoice,
    files: GivenFiles,
    out: Path,
    static_world: StaticWorld,
    new: NewFiles,
) -> GivenParts:
    """Return the parts of the scenario that are not estimated. Write a robot file if user and log name no robot.

    The robot file is added to `new`. Raises UsageError if the file exists, and OSError if it cannot be written.
    """
    reasons = {"world": choice.reason}
    if choice.map_reason is not None:
        reasons["map"] = choice.map_reason
    unknowns = [*choice.unknowns, *described.notes]
    stack = dict(described.stack)
    if files.robot:
        robot = relative_path(Path(files.robot), out) if Path(files.robot).is_file() else files.robot
        reasons["robot"] = Reason("given with --robot")
    elif described.robot is not None:
        robot = relative_path(described.robot, out) if isinstance(described.robot, Path) else described.robot
        reasons["robot"] = Reason("robot in the header of the log")
    else:
        clearance = float(static_world.distance_to_walls(drive.poses.values[:, :2]).min()) - WALL_MARGIN_M
        file = out.with_name(f"{scenario_stem(out)}.robot.yaml")
        new.add(file)
        written = write_robot_file(drive, file, _lidar_noise(drive, static_world), clearance)
        robot, unknowns = written.file.name, [*unknowns, *written.unknowns]
        reasons["robot"] = Reason(written.reason, None, None, "medium")
    if stack:
        reasons["stack"] = Reason("configuration of the stack in the header of the log")
    elif described.robot is None:
        unknowns.append("parameters of the navigation stack, besides the speed; the defaults are used")
        speed = observed_limits(drive)[0]
        stack = {"controller": {"type": "regulated_pure_pursuit", "desired_linear_vel": speed}}
        reasons["stack"] = Reason(f"the robot drives at up to {speed:.2f} m/s", None, None, "medium")
    return GivenParts(choice.written, choice.map, robot, described.seed, stack, reasons, unknowns)


def _lidar_noise(drive: RecordedDrive, static_world: StaticWorld) -> float:
    """Return the median standard deviation of the range noise in m; the value of a typical robot without scans."""
    scans = None if drive.scans is None else scans_with_pose(drive, drive.scans)
    if scans is None or len(scans) < 3:
        return TYPICAL_ROBOT.lidar_noise
    return float(np.median(compare_scans(drive, scans.thinned(NOISE_SCANS), static_world).noise))


def relative_path(file: Path, out: Path) -> str:
    """Return the path of a file relative to the folder of the scenario file `out`."""
    return os.path.relpath(file.resolve(), out.parent.resolve())


def scenario_stem(out: Path) -> str:
    """Return the name of the scenario file `out` without the extension `.scenario.yaml`."""
    return out.name.removesuffix(".yaml").removesuffix(".yml").removesuffix(".scenario")
