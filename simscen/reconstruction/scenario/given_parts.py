"""Chooses world, map, robot, and stack of the scenario.

The sources are, in this order: options of the user, the header of the log, and the messages in the log.
"""

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
    """World, map, and robot from options of the user. They replace the world, map, and robot in the log.

    `robot` is a robot file, the name of a shipped robot, or the name of a robot in the log; "" without this option.
    """

    world: Path | None = None
    map: Path | None = None
    robot: str = ""


class NewFiles:
    """Files that are written next to the scenario. They are removed if the reconstruction fails.

    `paths` are the paths of these files, in the order in which they are written.
    """

    def __init__(self) -> None:
        self.paths: list[Path] = []

    def add(self, *files: Path) -> None:
        """Add files that are written next. Raises UsageError if one of the files exists."""
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
    """World and map of the scenario.

    Attributes:
        world_value: Value of the key `world` in the scenario.
        world: World that this value describes.
        reason: Reason for the choice of the world.
        map_value: Value of the key `map` in the scenario; "" if the scenario does not have this key.
        map_reason: Reason for the choice of the map; None if the scenario does not have the key `map`.
        is_built: Whether the walls were built from the scans.
        unknowns: Phrases that complete the sentence "The log does not show …".
    """

    world_value: str | Mapping[str, Any]
    world: World
    reason: Reason
    map_value: str = ""
    map_reason: Reason | None = None
    is_built: bool = False
    unknowns: list[str] = field(default_factory=list)


def choose_world(
    drive: RecordedDrive, described: RunDescription, files: GivenFiles, out: Path, new_files: NewFiles
) -> WorldChoice:
    """Return the world and the map for the scenario file `out`, and write world and map files next to `out`.

    The written files are added to `new_files`. Raises InvalidInput for an unusable file, UsageError if a file to write
    exists, and OSError if it cannot be written.
    """
    if files.world is not None:
        choice = _world_from_file(files.world, out, Reason("given with --world"), new_files)
    elif isinstance(described.world, Path):
        choice = _world_from_file(described.world, out, Reason("world file in the header of the log"), new_files)
    elif isinstance(described.world, Mapping):
        spec = WorldSpec.model_validate(described.world)
        world = world_from_spec(spec, spec.name or "world")
        choice = WorldChoice(described.world, world, Reason("walls and obstacles in the header of the log"))
    else:
        return _world_from_map(drive, files, out, new_files)
    if not described.has_map:
        choice.map_value, choice.map_reason = "none", Reason("the log has no map")
    elif files.map is not None:
        choice.map_value, choice.map_reason = relative_path(files.map, out), Reason("given with --map")
    elif drive.map is not None and _have_different_walls(drive.map, StaticWorld(choice.world, drive.lidar_height).grid):
        file = _write_map(drive.map, out.with_name(f"{scenario_stem(out)}_map.yaml"), new_files)
        choice.map_value, choice.map_reason = file.name, Reason("the map on /map differs from the world", 0.0)
    return choice


def _write_map(grid: OccupancyGrid, file: Path, new_files: NewFiles) -> Path:
    """Write a ROS map with the name `file`, and an image next to it. Return `file`."""
    new_files.add(file, file.with_suffix(".pgm"))
    save_map(grid, file)
    return file


def _world_from_map(drive: RecordedDrive, files: GivenFiles, out: Path, new_files: NewFiles) -> WorldChoice:
    """Return a world with the walls of the given map, of the map in the log, or of a map built from the scans."""
    if files.map is not None:
        loaded = load_world_file(files.map, default_root([files.map]))
        if loaded.map is None:
            raise InvalidInput(
                [Problem(str(files.map), 0, 0, "SC320", "not a ROS map", "use --world for other worlds")]
            )
        grid, world_value = load_map(loaded.map), relative_path(files.map, out)
        return WorldChoice(world_value, world_from_map(grid, scenario_stem(out)), Reason("given with --map"))
    unknowns = ["walls and objects that no scan shows"]
    if drive.map is not None:
        grid, reason = drive.map, Reason("the walls are the occupied cells of /map", 0.0)
    else:
        grid = map_from_scans(drive)
        reason = Reason("built from the scans along the poses, because the log has no map", None, None, "medium")
        unknowns.append("which parts of the built map were on the robot's own map")
    file = _write_map(grid, out.with_name(f"{scenario_stem(out)}_map.yaml"), new_files)
    return WorldChoice(
        file.name,
        world_from_map(grid, scenario_stem(out)),
        reason,
        is_built=drive.map is None,
        unknowns=unknowns,
    )


def _world_from_file(file: Path, out: Path, reason: Reason, new_files: NewFiles) -> WorldChoice:
    """Return the world in `file`. Copy the file next to `out` if it is outside of the root folder of the scenario."""
    root = default_root([file])
    loaded = load_world_file(file, root)
    out_root = default_root([out])
    world_value = relative_path(file, out)
    if not file.resolve().is_relative_to(out_root.resolve()):
        copy = out.with_name(f"{scenario_stem(out)}{''.join(file.suffixes[-2:])}")
        if loaded.map is not None:
            _write_map(load_map(loaded.map), copy, new_files)
        else:
            new_files.add(copy)
            shutil.copyfile(file, copy)
        world_value = copy.name
    return WorldChoice(world_value, world_from_file(loaded, root), reason)


def _have_different_walls(first: OccupancyGrid, second: OccupancyGrid) -> bool:
    """Return whether two maps differ in size, in position, or in more than MAX_EQUAL_MAP_DIFFERENCE of their cells."""
    if first.shape != second.shape or first.origin.distance(second.origin) > 1e-6:
        return True
    return float(np.mean((first.cells > 50) != (second.cells > 50))) > MAX_EQUAL_MAP_DIFFERENCE


def prepare_given_parts(
    drive: RecordedDrive,
    described: RunDescription,
    choice: WorldChoice,
    files: GivenFiles,
    out: Path,
    static_world: StaticWorld,
    new_files: NewFiles,
) -> GivenParts:
    """Return the parts of the scenario that are not estimated. Write a robot file if neither user nor log name a robot.

    The robot file is added to `new_files`. Raises UsageError if the file exists, and OSError if it cannot be written.
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
        new_files.add(file)
        written_robot = write_robot_file(drive, file, _lidar_noise(drive, static_world), clearance)
        robot, unknowns = file.name, [*unknowns, *written_robot.unknowns]
        reasons["robot"] = Reason(written_robot.reason, None, None, "medium")
    if stack:
        reasons["stack"] = Reason("configuration of the stack in the header of the log")
    elif described.robot is None:
        unknowns.append("parameters of the navigation stack, besides the speed; the defaults are used")
        speed = observed_limits(drive)[0]
        stack = {"controller": {"type": "regulated_pure_pursuit", "desired_linear_vel": speed}}
        reasons["stack"] = Reason(f"the robot drives at up to {speed:.2f} m/s", None, None, "medium")
    return GivenParts(choice.world_value, choice.map_value, robot, described.seed, stack, reasons, unknowns)


def _lidar_noise(drive: RecordedDrive, static_world: StaticWorld) -> float:
    """Return the median standard deviation of the range noise in m; without scans, the noise of a typical robot."""
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
