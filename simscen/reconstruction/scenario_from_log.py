"""Entry point of the reconstruction: writes a scenario file from a log."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.loading.checks.scene_runner import check_in_world
from simscen.loading.files.discovery import default_root
from simscen.loading.scenario import try_variations
from simscen.loading.world_cache import WorldCache
from simscen.reconstruction.drive.reader import read_drive
from simscen.reconstruction.drive.recorded_drive import RecordedDrive
from simscen.reconstruction.drive.run_description import checked_robot_name, read_description
from simscen.reconstruction.estimators import run_estimators
from simscen.reconstruction.objects.find_objects import object_of_robot
from simscen.reconstruction.scenario.contents import EstimatedParts, GivenParts, ScenarioContents, scenario_contents
from simscen.reconstruction.scenario.given_parts import (
    GivenFiles,
    NewFiles,
    choose_world,
    prepare_given_parts,
    scenario_stem,
)
from simscen.reconstruction.scenario.robot_file import robot_properties
from simscen.reconstruction.scenario.scenario_text import scenario_text
from simscen.reconstruction.static_world import StaticWorld


@dataclass(frozen=True)
class ReconstructionOptions:
    """Options of a reconstruction.

    Attributes:
        truth: Ground truth in the log, see `read_drive`.
        topics: Topics by role such as "odom", for roles whose topic is not the default.
        files: World, map, and robot that replace the ones in the log.
        root: Folder of the files that the recorded scenario refers to; None for the working folder.
    """

    truth: str | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    files: GivenFiles = field(default_factory=GivenFiles)
    root: Path | None = None


@dataclass(frozen=True)
class Reconstruction:
    """Result of a reconstruction.

    Attributes:
        log: Path of the log.
        files: Written files. The first one is the scenario file.
        drive: Recorded drive in the log.
        contents: Contents of the scenario file.
        static_world: World with which the scans of the drive were compared.
    """

    log: Path
    files: tuple[Path, ...]
    drive: RecordedDrive
    contents: ScenarioContents
    static_world: StaticWorld

    @property
    def file(self) -> Path:
        """The scenario file."""
        return self.files[0]

    def summary(self) -> Iterator[str]:
        """Yield lines for the user: the number of goals and found objects, then each fault and each incident."""
        estimated = self.contents.estimated
        pedestrians = sum(thing.pedestrian is not None for thing in estimated.objects)
        moving = sum(thing.is_moving for thing in estimated.objects) - pedestrians
        standing = len(estimated.objects) - moving - pedestrians
        counts = (
            (len(self.contents.goals), "goal"),
            (pedestrians, "pedestrian"),
            (moving, "moving object"),
            (standing, "standing object"),
            (len(estimated.faults), "fault"),
        )
        yield "found " + ", ".join(f"{count} {name}{'' if count == 1 else 's'}" for count, name in counts)
        for fault in estimated.faults:
            yield f"  {fault.target}.{fault.kind}: {fault.reason.comment}"
        for incident in estimated.incidents:
            yield f"  incident at {incident.time:.2f} s: {incident.kind}, {incident.detail}"


def _write_valid_scenario(
    drive: RecordedDrive, given: GivenParts, estimated: EstimatedParts, log: Path, out: Path
) -> ScenarioContents:
    """Write the scenario file, and return its contents.

    Objects and faults that make the scenario invalid, such as an object inside the robot, are left out. An invalid
    pedestrian is first replaced by a scripted object. The file lists all parts that are left out, and the remaining
    problems, for the user. Raises InvalidInput if the file cannot be loaded for another reason.
    """
    name = scenario_stem(out).replace("_", " ")
    while True:
        contents = scenario_contents(drive, given, estimated, name, log.name)
        out.write_text(scenario_text(contents), encoding="utf-8")
        loaded = try_variations(out, default_root([out]))
        if isinstance(loaded, list):
            estimated = _without_invalid_faults(estimated, loaded)
            continue
        errors = {problem.message for problem in check_in_world(loaded[0], WorldCache()) if problem.severity == "error"}
        invalid = {thing.name for thing in estimated.objects if any(f"`{thing.name}`" in error for error in errors)}
        if not invalid:
            break
        pedestrians = {thing.name for thing in estimated.objects if thing.pedestrian is not None}
        omitted = invalid - pedestrians
        objects = [
            replace(thing, pedestrian=None) if thing.name in invalid else thing
            for thing in estimated.objects
            if thing.name not in omitted
        ]
        unknowns = [f"a valid place of {name}, which is left out" for name in sorted(omitted)]
        estimated = replace(estimated, objects=objects, unknowns=[*estimated.unknowns, *unknowns])
    if errors:
        unknowns = [f"the cause of an error, which you must correct before a run: {error}" for error in errors]
        estimated = replace(estimated, unknowns=[*estimated.unknowns, *sorted(unknowns)])
        contents = scenario_contents(drive, given, estimated, name, log.name)
        out.write_text(scenario_text(contents), encoding="utf-8")
    return contents


def _without_invalid_faults(estimated: EstimatedParts, problems: list[Problem]) -> EstimatedParts:
    """Return the parts without the faults that `problems` mention. Raises InvalidInput if no fault is mentioned."""
    messages = "\n".join(problem.message for problem in problems)
    invalid = [fault for fault in estimated.faults if f"fault `{fault.kind}` does not fit `{fault.target}`" in messages]
    if not invalid:
        raise InvalidInput(problems)
    unknowns = [
        f"a valid form of a fault of {fault.target}, which is left out: {fault.reason.comment}" for fault in invalid
    ]
    faults = [fault for fault in estimated.faults if fault not in invalid]
    return replace(estimated, faults=faults, unknowns=[*estimated.unknowns, *unknowns])


def scenario_from_log(log: Path, out: Path, options: ReconstructionOptions) -> Reconstruction:
    """Write the scenario file `out` from a log, and next to it the map and robot files that the scenario needs.

    For a log with several robots, `options.files.robot` is the name of the robot to reconstruct. Raises InvalidInput
    for an unusable log or file, UsageError if a map or robot file to write exists, and OSError if a file cannot be
    written. After an exception, the new map and robot files are removed.
    """
    new_files = NewFiles()
    try:
        return _reconstruct(log, out, options, new_files)
    except BaseException:
        new_files.remove()
        raise


def _reconstruct(log: Path, out: Path, options: ReconstructionOptions, new_files: NewFiles) -> Reconstruction:
    """Write the scenario file `out`, and write other files, which are added to `new_files`."""
    robot_name = checked_robot_name(log, options.files.robot)
    files = replace(options.files, robot="") if robot_name else options.files
    drive = read_drive(log, options.truth, options.topics, robot_name)
    described = read_description(log, options.root or Path.cwd(), robot_name)
    choice = choose_world(drive, described, files, out, new_files)
    static_world = StaticWorld(choice.world, drive.lidar_height)
    given = prepare_given_parts(drive, described, choice, files, out, static_world, new_files)
    is_known = bool(files.robot) or described.robot is not None
    robot = robot_properties(given.robot, out.parent, is_known)
    other_robots = [
        object_of_robot(name, outline, times[times >= drive.begin] - drive.begin, poses[times >= drive.begin])
        for name, outline, times, poses in described.other_robots
    ]
    estimated = run_estimators(drive, static_world, robot, other_robots, choice.is_built)
    contents = _write_valid_scenario(drive, given, estimated, log, out)
    return Reconstruction(log, (out, *new_files.paths), drive, contents, static_world)
