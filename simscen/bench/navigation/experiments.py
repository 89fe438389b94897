"""Experiments of `simscen bench nav`: scenarios with seeds.

Generated scenarios are written as files, so that each run can be repeated with `simscen run`.
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
from simscen.bench.navigation.barn import CELL_SIZE_M, HEIGHT_M, ObstacleField, obstacle_field
from simscen.core.random_streams import Streams


@dataclass(frozen=True)
class Drive:
    """Scenario file, the seeds to run it with, and the reference length of BARN in m, if there is one.

    `world` groups drives for confidence intervals, because drives in the same world are not independent.
    """

    file: Path
    seeds: Sequence[int]
    reference_length: float | None = None
    world: str = ""


@dataclass(frozen=True)
class Experiment:
    """Drives that become one row of the table.

    Attributes:
        root: Folder of the scenarios.
        world_path: Folders for `--world-path`.
        localization: Whether to measure the consistency of the pose estimates.
        mapless: Whether the robot has no map, so that only some localizers work.
    """

    name: str
    drives: tuple[Drive, ...]
    root: Path
    world_path: tuple[Path, ...] = ()
    localization: bool = False
    mapless: bool = False


NARROW_MARGINS_M = (0.30, 0.20, 0.10)
"""Width of the widest path through a narrow field minus the width of the robot."""
ROBOT_WIDTH_M = 0.42
"""Width of the robot across its wheels."""
LOCALIZATIONS = ("tour", "start 0.5 m and 20° off", "start unknown", "kidnapped")
"""Names of the localization experiments."""


def barn_challenge(
    folder: Path, dataset: Path, seeds: Sequence[int], variant: str = "", stack: str = barn.TUNED_STACK
) -> Experiment:
    """Return the drives in the worlds of BARN. `stack` are the lines below `stack:`. Raises UsageError for bad data."""
    name = f"BARN, {variant}" if variant else "BARN"
    drives = []
    for world in barn.barn_worlds(dataset):
        text = barn.scenario(world.file.stem, world.file.name, stack=stack)
        file = folder / "barn" / (variant.replace("/", " per ") or "tuned") / f"{world.file.stem}.scenario.yaml"
        drives.append(Drive(write_scenario(file, text), seeds, world.reference_length))
    return Experiment(name, tuple(drives), folder, (dataset,), mapless=True)


def generated_fields(folder: Path, numbers: Iterable[int]) -> Experiment:
    """Return drives in generated fields like those of BARN, with one seed each."""
    drives = [_field_drive(folder / "fields", obstacle_field(number)) for number in numbers]
    return Experiment("generated fields", tuple(drives), folder, mapless=True)


def narrow_fields(folder: Path, numbers: Sequence[int]) -> list[Experiment]:
    """Return one experiment for each of NARROW_MARGINS_M, with fields whose widest path has this margin."""
    experiments = []
    for margin in NARROW_MARGINS_M:
        crossing_radius, blocked_radius = (ROBOT_WIDTH_M + margin) / 2, (ROBOT_WIDTH_M + margin + 0.1) / 2
        target = folder / f"narrow/{round(100 * margin)}_cm"
        drives = [_field_drive(target, obstacle_field(number, crossing_radius, blocked_radius)) for number in numbers]
        experiments.append(Experiment(narrow_name(margin), tuple(drives), folder, mapless=True))
    return experiments


def narrow_name(margin: float) -> str:
    """Return the name of the experiment with a margin in m."""
    return f"narrow fields, robot + {100 * margin:.0f} cm"


def _field_drive(folder: Path, field: ObstacleField) -> Drive:
    world = write_scenario(folder / f"field_{field.number}.world.yaml", _world_text(field))
    text = barn.scenario(f"field {field.number}", world.name)
    file = write_scenario(folder / f"field_{field.number}.scenario.yaml", text)
    return Drive(file, [field.number], field.shortest)


def dynamic_fields(folder: Path, numbers: Sequence[int]) -> list[Experiment]:
    """Return one experiment for each mean speed, with fields of moving cylinders and one seed each."""
    experiments = []
    for speed in barn.SPEEDS_M_S:
        drives = []
        for number in numbers:
            stem = f"dynamic/field_{number}_at_{speed:.2f}"
            world = write_scenario(folder / f"{stem}.world.yaml", _moving_world_text(barn.dynamic_field(number, speed)))
            text = barn.scenario(
                f"dynamic field {number}",
                world.name,
                barn.DYNABARN_START,
                barn.DYNABARN_GOAL,
                barn.TUNED_STACK_FOR_MOVING_WORLDS,
            )
            length = barn.DYNABARN_START.distance(barn.DYNABARN_GOAL)
            drives.append(Drive(write_scenario(folder / f"{stem}.scenario.yaml", text), [number], length))
        experiments.append(Experiment(dynamic_name(speed), tuple(drives), folder, mapless=True))
    return experiments


def dynamic_name(speed: float) -> str:
    """Return the name of the experiment with a mean speed in m/s."""
    return f"dynamic fields, {speed:.2f} m/s"


def sandbox(folder: Path, nav2: Path, seeds: Sequence[int]) -> list[Experiment]:
    """Return the system test of Nav2, without and with a box that is not on the map."""
    return [
        Experiment(
            name,
            (
                Drive(
                    write_scenario(folder / f"nav2/{stem}.scenario.yaml", sandbox_scenario(name, box)),
                    seeds,
                ),
            ),
            folder,
            (nav2, nav2 / "models"),
        )
        for name, stem, box in (("tb3_sandbox", "plain", False), ("tb3_sandbox, unmapped box", "with_box", True))
    ]


def corner_cases(scenarios: Path, root: Path, seeds: Sequence[int]) -> list[Experiment]:
    """Return one experiment for each shipped corner case."""
    return [Experiment(case_name(file), (Drive(file, seeds),), root) for file in case_files(scenarios)]


def case_files(scenarios: Path) -> list[Path]:
    """Return the scenario files of the shipped corner cases."""
    return sorted(scenarios.glob("corner_cases/*.scenario.yaml"))


def case_name(file: Path) -> str:
    """Return the name of the experiment with a corner case."""
    return file.name.split(".")[0].replace("_", " ")


def localization_experiments(folder: Path, worlds: Path, seeds: Sequence[int], lost: Sequence[int]) -> list[Experiment]:
    """Return the localization experiments in the shipped house.

    The robot drives a tour with a known start for each of `seeds`. For each seed in `lost`, the initial estimate is
    wrong by 0.5 m and 20 degrees, is unknown, or the robot is kidnapped.
    """

    def experiment(name: str, *drives: Drive, known: bool = False) -> Experiment:
        return Experiment(f"localization, {name}", drives, folder, (worlds,), localization=known)

    def drive(stem: str, text: str, seeds: Sequence[int]) -> Drive:
        return Drive(write_scenario(folder / f"localization/{stem}.scenario.yaml", text), seeds)

    directions = {seed: float(Streams(seed).generator("direction").uniform(-np.pi, np.pi)) for seed in lost}
    wrong_start = [drive(f"wrong_start_{n}", wrong_start_scenario(directions[n], n % 2 == 0), [n]) for n in lost]
    tour = experiment(LOCALIZATIONS[0], drive("tour", tour_scenario(), seeds), known=True)
    if not lost:
        return [tour]
    return [
        tour,
        experiment(LOCALIZATIONS[1], *wrong_start, known=True),
        experiment(LOCALIZATIONS[2], drive("start_unknown", start_unknown_scenario(), lost)),
        experiment(LOCALIZATIONS[3], drive("kidnapped", kidnapped_scenario(), lost)),
    ]


def _world_text(field: ObstacleField) -> str:
    pillars = "\n".join(
        f"  - {{name: pillar, cylinder: [{CELL_SIZE_M / 2:g}, {HEIGHT_M:g}], pose: {{x: {x:.3f}, y: {y:.3f}}}}}"
        for x, y in field.centers.tolist()
    )
    return f"simscen: 1\nname: field {field.number}\nobstacles:\n{pillars}\n"


def _moving_world_text(field: barn.DynamicField) -> str:
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


def write_scenario(file: Path, text: str) -> Path:
    """Write a scenario or world file, and return its path."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def with_stack_parameters(experiment: Experiment, name: str, stack: Mapping[str, Any], folder: Path) -> Experiment:
    """Return the same drives with additional stack parameters, as files in `folder` that extend the scenarios.

    If the drives have no map, `localizer` of `stack` is ignored.
    """
    drives = []
    stack = {key: value for key, value in stack.items() if not (experiment.mapless and key == "localizer")}
    for number, drive in enumerate(experiment.drives, start=1):
        stem = drive.file.name.split(".")[0]
        file = folder / f"{number}_{stem}.scenario.yaml"
        text = f"simscen: 1\nextends: {json.dumps(os.path.relpath(drive.file, folder))}\nstack: {json.dumps(stack)}\n"
        drives.append(replace(drive, file=write_scenario(file, text), world=drive.world or str(drive.file)))
    return replace(
        experiment,
        name=name,
        drives=tuple(drives),
        root=folder.parent,
        world_path=(experiment.root, *experiment.world_path),
    )


SANDBOX_BOX = "obstacles:\n    - {name: cardboard box, box: [0.5, 0.4, 0.3], pose: {x: -1.0, y: 0.6}}\n"
"""The `cardboard_box` of Gazebo at the place of the unmapped obstacle of Nav2."""


def sandbox_scenario(name: str, box: bool) -> str:
    """Return the text of the scenario, which needs --world-path for its world and map."""
    return f"""\
simscen: 1
name: "{name}"
world:
  simscen: 1
  name: tb3_sandbox
  sdf: worlds/tb3_sandbox.sdf.xacro
  {SANDBOX_BOX if box else ""}
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
"""Pose of the dock in the house: x, y in m, yaw in rad."""
ESTIMATE_OFFSET_M, ESTIMATE_ROTATION_RAD = 0.5, math.radians(20.0)
"""Error of the initial estimate in m and rad."""

GOALS = """\
goals:
  - {pose: sofa, timeout: 120 s}
  - {pose: kitchen, timeout: 120 s}
  - {pose: study, timeout: 120 s}
"""


def tour_scenario() -> str:
    """Return the text of a tour through three rooms with a known start and default noise."""
    return f"""\
simscen: 1
name: tour of the house
world: house.world.yaml
robot: {{pose: dock}}
{GOALS}pass:
  - goals_reached: {{}}
  - localization_error: {{rmse: 5 cm, after: 5 s}}
  - collisions: {{max: 0}}
"""


def wrong_start_scenario(direction: float, left: bool) -> str:
    """Return the text of a drive with a wrong initial estimate, and a correct one required at the goal.

    The estimate is off by ESTIMATE_OFFSET_M in `direction` (rad), and by ESTIMATE_ROTATION_RAD to the `left` or right.
    """
    x, y = START[0] + ESTIMATE_OFFSET_M * math.cos(direction), START[1] + ESTIMATE_OFFSET_M * math.sin(direction)
    yaw = START[2] + (ESTIMATE_ROTATION_RAD if left else -ESTIMATE_ROTATION_RAD)
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


SELF_LOCALIZATION = """\
goals:
  - {pose: kitchen, timeout: 200 s}
time_limit: 210 s
pass:
  - goals_reached: {}
  - localization_error: {final: 0.2 m}
  - collisions: {max: 0, caused_by_robot: true}
"""
"""All parameters have their defaults. A robot that cannot plan localizes itself while a recovery turns it."""


def start_unknown_scenario() -> str:
    """Return the text of a drive without an initial estimate."""
    return f"""\
simscen: 1
name: start unknown
world: house.world.yaml
robot: {{pose: dock, initial_estimate: unknown}}
{SELF_LOCALIZATION}"""


def kidnapped_scenario() -> str:
    """Return the text of a drive in which the robot is kidnapped after 3 m, from the corridor to the study."""
    return f"""\
simscen: 1
name: kidnapped
world: house.world.yaml
robot: {{pose: dock}}
events:
  - {{name: kidnapped, when: {{travelled: 3 m}}, do: {{kidnap: {{pose: {{x: 9.4, y: 7.3, yaw: 90 deg}}}}}}}}
{SELF_LOCALIZATION}"""
