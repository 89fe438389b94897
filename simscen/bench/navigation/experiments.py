"""Experiments of `simscen bench nav`. An experiment is a list of drives: scenario files, each with its seeds.

The functions `write_…` write scenario files to `folder` and return the experiments. All random values of a generated
field or drive are derived from its number.
"""

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from simscen.bench.navigation import barn
from simscen.bench.navigation.barn import CELL_SIZE_M, HEIGHT_M, ObstacleField, generate_obstacle_field
from simscen.core.random_streams import Streams


@dataclass(frozen=True)
class Drive:
    """Scenario file with the seeds of its runs.

    `reference_length` is the length in m of the reference path for the BARN score; None without a score. `world` is the
    name of the world, by which runs are grouped; a drive with the name "" is a group of its own.
    """

    file: Path
    seeds: Sequence[int]
    reference_length: float | None = None
    world: str = ""


@dataclass(frozen=True)
class Experiment:
    """Drives that form one row of the result table.

    root:                  folder of all scenario files
    world_path:            folders for `--world-path`
    measures_localization: whether the errors of the pose estimates are measured as well
    is_mapless:            whether the robot has no map
    """

    name: str
    drives: tuple[Drive, ...]
    root: Path
    world_path: tuple[Path, ...] = ()
    measures_localization: bool = False
    is_mapless: bool = False


NARROW_MARGINS_M = (0.30, 0.20, 0.10)
"""Guaranteed width of a passage through a narrow field, minus ROBOT_WIDTH_M. The true width is at most 0.1 m larger."""
ROBOT_WIDTH_M = 0.42
"""Width of the Jackal across its wheels."""
LOCALIZATION_EXPERIMENTS = ("tour", "start 0.5 m and 20° off", "start unknown", "kidnapped")
"""Names of the localization experiments."""


def write_barn_challenge(
    folder: Path, dataset: Path, seeds: Sequence[int], variant: str = "", stack: str = barn.TUNED_STACK
) -> Experiment:
    """Write a drive in each world of BARN. Raises UsageError if `dataset`, the folder with the worlds, is invalid.

    `stack` are the YAML lines below `stack:`. `variant` is the name of this stack; "" for TUNED_STACK.
    """
    name = f"BARN, {variant}" if variant else "BARN"
    drives = []
    for world in barn.read_barn_worlds(dataset):
        text = barn.scenario_text(world.file.stem, world.file.name, stack=stack)
        file = folder / "barn" / (variant.replace("/", " per ") or "tuned") / f"{world.file.stem}.scenario.yaml"
        drives.append(Drive(write_text(file, text), seeds, world.reference_length))
    return Experiment(name, tuple(drives), folder, (dataset,), is_mapless=True)


def write_generated_fields(folder: Path, numbers: Iterable[int]) -> Experiment:
    """Write a drive through the generated field of each number. The seed of a run is the number of its field."""
    drives = [_field_drive(folder / "fields", generate_obstacle_field(number)) for number in numbers]
    return Experiment("generated fields", tuple(drives), folder, is_mapless=True)


def write_narrow_fields(folder: Path, numbers: Sequence[int]) -> list[Experiment]:
    """Write one experiment with narrow generated fields for each of NARROW_MARGINS_M."""
    experiments = []
    for margin in NARROW_MARGINS_M:
        crossing_radius, blocked_radius = (ROBOT_WIDTH_M + margin) / 2, (ROBOT_WIDTH_M + margin + 0.1) / 2
        target = folder / f"narrow/{round(100 * margin)}_cm"
        drives = [
            _field_drive(target, generate_obstacle_field(number, crossing_radius, blocked_radius)) for number in numbers
        ]
        experiments.append(Experiment(narrow_fields_name(margin), tuple(drives), folder, is_mapless=True))
    return experiments


def narrow_fields_name(margin: float) -> str:
    """Return the name of the experiment for one of NARROW_MARGINS_M."""
    return f"narrow fields, robot + {100 * margin:.0f} cm"


def _field_drive(folder: Path, field: ObstacleField) -> Drive:
    """Write the world and the scenario of a drive through a field to `folder`."""
    world = write_text(folder / f"field_{field.number}.world.yaml", _world_text(field))
    text = barn.scenario_text(f"field {field.number}", world.name)
    file = write_text(folder / f"field_{field.number}.scenario.yaml", text)
    return Drive(file, [field.number], field.shortest_path_m)


def write_dynamic_fields(folder: Path, numbers: Sequence[int]) -> list[Experiment]:
    """Write one experiment for each of barn.SPEEDS_M_S, with generated fields of moving cylinders."""
    experiments = []
    start, goal, stack = barn.DYNABARN_START, barn.DYNABARN_GOAL, barn.TUNED_STACK_FOR_MOVING_WORLDS
    for speed in barn.SPEEDS_M_S:
        drives = []
        for number in numbers:
            stem = f"dynamic/field_{number}_at_{speed:.2f}"
            world = write_text(
                folder / f"{stem}.world.yaml", _dynamic_world_text(barn.generate_dynamic_field(number, speed))
            )
            text = barn.scenario_text(f"dynamic field {number}", world.name, start, goal, stack)
            file = write_text(folder / f"{stem}.scenario.yaml", text)
            drives.append(Drive(file, [number], start.distance(goal)))
        experiments.append(Experiment(dynamic_fields_name(speed), tuple(drives), folder, is_mapless=True))
    return experiments


def dynamic_fields_name(speed: float) -> str:
    """Return the name of the experiment for one of barn.SPEEDS_M_S."""
    return f"dynamic fields, {speed:.2f} m/s"


def write_sandbox(folder: Path, nav2: Path, seeds: Sequence[int]) -> list[Experiment]:
    """Write the drive of Nav2's system test, once without and once with a box that is not on the map.

    `nav2` is the folder with the world and map of this test.
    """
    experiments = []
    for name, stem, has_box in (("tb3_sandbox", "plain", False), ("tb3_sandbox, unmapped box", "with_box", True)):
        file = write_text(folder / f"nav2/{stem}.scenario.yaml", sandbox_scenario(name, has_box))
        experiments.append(Experiment(name, (Drive(file, seeds),), folder, (nav2, nav2 / "models")))
    return experiments


def corner_cases(scenarios: Path, root: Path, seeds: Sequence[int]) -> list[Experiment]:
    """Return one experiment for each corner case in the folder `scenarios`."""
    return [Experiment(corner_case_name(file), (Drive(file, seeds),), root) for file in corner_case_files(scenarios)]


def corner_case_files(scenarios: Path) -> list[Path]:
    """Return the scenario files of the corner cases in the folder `scenarios`."""
    return sorted(scenarios.glob("corner_cases/*.scenario.yaml"))


def corner_case_name(file: Path) -> str:
    """Return the name of the experiment with the corner case in this scenario file."""
    return file.name.split(".")[0].replace("_", " ")


def write_localization_experiments(
    folder: Path, worlds: Path, tour_seeds: Sequence[int], lost_seeds: Sequence[int]
) -> list[Experiment]:
    """Write the experiments LOCALIZATION_EXPERIMENTS in the world house.world.yaml of the folder `worlds`.

    The experiment "tour" has the seeds `tour_seeds`. The other experiments have the seeds `lost_seeds`, and are omitted
    if there are none.
    """

    def experiment(name: str, *drives: Drive, is_measured: bool = False) -> Experiment:
        return Experiment(f"localization, {name}", drives, folder, (worlds,), measures_localization=is_measured)

    def drive(stem: str, text: str, seeds: Sequence[int]) -> Drive:
        return Drive(write_text(folder / f"localization/{stem}.scenario.yaml", text), seeds, world="house")

    names = LOCALIZATION_EXPERIMENTS
    directions = {seed: float(Streams(seed).generator("direction").uniform(-np.pi, np.pi)) for seed in lost_seeds}
    wrong_start = [drive(f"wrong_start_{n}", wrong_start_scenario(directions[n], n % 2 == 0), [n]) for n in lost_seeds]
    tour = experiment(names[0], drive("tour", tour_scenario(), tour_seeds), is_measured=True)
    if not lost_seeds:
        return [tour]
    return [
        tour,
        experiment(names[1], *wrong_start, is_measured=True),
        experiment(names[2], drive("start_unknown", start_unknown_scenario(), lost_seeds)),
        experiment(names[3], drive("kidnapped", kidnapped_scenario(), lost_seeds)),
    ]


def _world_text(field: ObstacleField) -> str:
    """Return the YAML of a world with the cylinders of a field."""
    pillars = "\n".join(
        f"  - {{name: pillar, cylinder: [{CELL_SIZE_M / 2:g}, {HEIGHT_M:g}], pose: {{x: {x:.3f}, y: {y:.3f}}}}}"
        for x, y in field.centers.tolist()
    )
    return f"simscen: 1\nname: field {field.number}\nobstacles:\n{pillars}\n"


def _dynamic_world_text(field: barn.DynamicField) -> str:
    """Return the YAML of a world with the moving cylinders of a field."""
    lines = []
    for number, mover in enumerate(field.movers, start=1):
        keyframes = ", ".join(
            f"[{time:.3f}, {x:.3f}, {y:.3f}, 0]"
            for time, (x, y) in zip(mover.times.tolist(), mover.points.tolist(), strict=True)
        )
        x, y = mover.points[0].tolist()
        lines.append(
            f"  - name: cylinder {number}\n    cylinder: [{barn.MOVER_RADIUS_M:g}, {barn.HEIGHT_M:g}]\n"
            f"    pose: {{x: {x:.3f}, y: {y:.3f}}}\n    move:\n      keyframes: [{keyframes}]\n"
            f"      repeat: back_and_forth\n      ease: spline\n      phase: {mover.phase:.3f} s\n"
        )
    return f"simscen: 1\nname: dynamic field {field.number}\nobjects:\n{''.join(lines)}"


def write_text(file: Path, text: str) -> Path:
    """Write a scenario or another text file, and return its path."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def with_stack_parameters(experiment: Experiment, name: str, stack: Mapping[str, Any], folder: Path) -> Experiment:
    """Write a copy of an experiment with a new name. `stack` is the value of the key `stack` in its scenarios.

    The new scenarios, in `folder`, extend the original scenarios. The key `localizer` is ignored for mapless drives.
    """
    drives = []
    stack = {key: value for key, value in stack.items() if not (experiment.is_mapless and key == "localizer")}
    for number, drive in enumerate(experiment.drives, start=1):
        stem = drive.file.name.split(".")[0]
        file = folder / f"{number}_{stem}.scenario.yaml"
        text = f"simscen: 1\nextends: {json.dumps(os.path.relpath(drive.file, folder))}\nstack: {json.dumps(stack)}\n"
        drives.append(replace(drive, file=write_text(file, text), world=drive.world or str(drive.file)))
    return replace(
        experiment,
        name=name,
        drives=tuple(drives),
        root=folder.parent,
        world_path=(experiment.root, *experiment.world_path),
    )


SANDBOX_BOX = "obstacles:\n    - {name: cardboard box, box: [0.5, 0.4, 0.3], pose: {x: -1.0, y: 0.6}}\n"
"""YAML of a box like Gazebo's `cardboard_box`, at the position of the unmapped obstacle in Nav2's system test."""


def sandbox_scenario(name: str, has_box: bool) -> str:
    """Return the scenario YAML of the drive of Nav2's system test."""
    return f"""\
simscen: 1
name: "{name}"
world:
  simscen: 1
  name: tb3_sandbox
  sdf: worlds/tb3_sandbox.sdf.xacro
  {SANDBOX_BOX if has_box else ""}
map: tb3_sandbox.yaml
robot: {{model: turtlebot, pose: {{x: -2.0, y: -0.5, yaw: 0}}}}
goals:
  - {{name: goal, pose: {{x: 0.0, y: 2.0, yaw: 0}}}}
time_limit: 120 s
pass:
  - goals_reached: {{tolerance: 0.25 m, yaw_tolerance: 20 deg}}
  - collisions: {{max: 0}}
"""


START = (0.8, 4.95, 0.0)
"""Start of all drives in the house, at its place `dock`: x and y in m, yaw in rad."""
ESTIMATE_OFFSET_M, ESTIMATE_ROTATION_RAD = 0.5, math.radians(20.0)
"""Position and yaw error of a wrong initial estimate."""

TOUR_GOALS = """\
goals:
  - {pose: sofa, timeout: 120 s}
  - {pose: kitchen, timeout: 120 s}
  - {pose: study, timeout: 120 s}
"""


def tour_scenario() -> str:
    """Return the scenario YAML of a drive through three rooms with a known start."""
    return f"""\
simscen: 1
name: tour of the house
world: house.world.yaml
robot: {{pose: dock}}
{TOUR_GOALS}pass:
  - goals_reached: {{}}
  - localization_error: {{rmse: 5 cm, after: 5 s}}
  - collisions: {{max: 0}}
"""


def wrong_start_scenario(direction: float, turns_left: bool) -> str:
    """Return the scenario YAML of a drive with a wrong initial estimate.

    The estimate is shifted by ESTIMATE_OFFSET_M in `direction` (rad). It is rotated by ESTIMATE_ROTATION_RAD, to the
    left if `turns_left`, otherwise to the right.
    """
    x, y = START[0] + ESTIMATE_OFFSET_M * math.cos(direction), START[1] + ESTIMATE_OFFSET_M * math.sin(direction)
    yaw = START[2] + (ESTIMATE_ROTATION_RAD if turns_left else -ESTIMATE_ROTATION_RAD)
    return f"""\
simscen: 1
name: wrong initial estimate
world: house.world.yaml
robot:
  pose: dock
  initial_estimate: {{x: {x:.4f}, y: {y:.4f}, yaw: {yaw:.5f}}}
goals:
  - {{pose: kitchen, timeout: 120 s}}
pass:
  - goals_reached: {{}}
  - localization_error: {{final: 10 cm}}
  - collisions: {{max: 0}}
"""


SELF_LOCALIZATION_LINES = """\
goals:
  - {pose: kitchen, timeout: 200 s}
time_limit: 210 s
pass:
  - goals_reached: {}
  - localization_error: {final: 0.2 m}
  - collisions: {max: 0, caused_by_robot: true}
"""
"""Last YAML lines of the scenarios in which the robot must localize itself."""


def start_unknown_scenario() -> str:
    """Return the scenario YAML of a drive without an initial estimate."""
    return f"""\
simscen: 1
name: start unknown
world: house.world.yaml
robot: {{pose: dock, initial_estimate: unknown}}
{SELF_LOCALIZATION_LINES}"""


def kidnapped_scenario() -> str:
    """Return the scenario YAML of a drive in which the robot is kidnapped to the room "study" after 3 m."""
    return f"""\
simscen: 1
name: kidnapped
world: house.world.yaml
robot: {{pose: dock}}
events:
  - {{name: kidnapped, when: {{travelled: 3 m}}, do: {{kidnap: {{pose: {{x: 9.4, y: 7.3, yaw: 90 deg}}}}}}}}
{SELF_LOCALIZATION_LINES}"""
