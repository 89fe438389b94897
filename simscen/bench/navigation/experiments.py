"""What `simscen bench nav` drives: experiments, each a number of scenarios with seeds.

Scenarios that are generated are written as files, so that everything goes through the front door and any run of them
can be repeated by hand.
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
from simscen.bench.navigation import dynamic_fields as movers
from simscen.bench.navigation.obstacle_fields import CELL, HEIGHT, ObstacleField, obstacle_field
from simscen.core.random_streams import Streams


@dataclass(frozen=True)
class Drive:
    """A scenario file, the seeds to run it with, and BARN's reference length in meters where it has one.

    `world` tells worlds apart, over which success rates are compared: drives in one world are no independent evidence.
    """

    file: Path
    seeds: Sequence[int]
    reference_length: float | None = None
    world: str = ""


@dataclass(frozen=True)
class Experiment:
    """One line of the table. `root` and `world_path` are what `simscen run` needs to find everything.

    `mapless`: the robot has no map, so that only some localizers can be tried.
    """

    name: str
    drives: tuple[Drive, ...]
    root: Path
    world_path: tuple[Path, ...] = ()
    localization: bool = False
    mapless: bool = False


NARROW = (0.30, 0.20, 0.10)
"""Meters that the widest way through a narrow field is wider than the robot."""
WIDTH = 0.42
"""Meters from wheel to wheel of the robot that drives there."""
LOCALIZATIONS = ("tour", "told 0.5 m and 20° off", "start unknown", "kidnapped")
"""What the experiments on localization are called."""


def barn_challenge(
    folder: Path, dataset: Path, seeds: Sequence[int], variant: str = "", stack: str = barn.TUNED
) -> Experiment:
    """The worlds of the dataset with these lines below `stack:`. Raises UsageError when it is unusable."""
    name = f"BARN, {variant}" if variant else "BARN"
    drives = []
    for world in barn.barn_worlds(dataset):
        text = barn.scenario(world.file.stem, world.file.name, stack=stack)
        file = folder / "barn" / (variant.replace("/", " per ") or "tuned") / f"{world.file.stem}.scenario.yaml"
        drives.append(Drive(write_scenario(file, text), seeds, world.reference_length))
    return Experiment(name, tuple(drives), folder, (dataset,), mapless=True)


def generated_fields(folder: Path, numbers: Iterable[int]) -> Experiment:
    """Fields of the same kind and density, one seed each."""
    drives = [_field(folder / "fields", obstacle_field(number)) for number in numbers]
    return Experiment("generated fields", tuple(drives), folder, mapless=True)


def narrow_fields(folder: Path, numbers: Sequence[int]) -> list[Experiment]:
    """Fields whose widest way is little wider than the robot: an experiment for each of three widths."""
    experiments = []
    for room in NARROW:
        gap, too_wide = (WIDTH + room) / 2, (WIDTH + room + 0.1) / 2
        to = folder / f"narrow/{round(100 * room)}_cm"
        drives = [_field(to, obstacle_field(number, gap, too_wide)) for number in numbers]
        experiments.append(Experiment(narrow_name(room), tuple(drives), folder, mapless=True))
    return experiments


def narrow_name(room: float) -> str:
    """What the experiment is called with this much room in meters."""
    return f"narrow fields, robot + {100 * room:.0f} cm"


def _field(folder: Path, field: ObstacleField) -> Drive:
    world = write_scenario(folder / f"field_{field.number}.world.yaml", _world_text(field))
    text = barn.scenario(f"field {field.number}", world.name)
    file = write_scenario(folder / f"field_{field.number}.scenario.yaml", text)
    return Drive(file, [field.number], field.shortest)


def dynamic_fields(folder: Path, numbers: Sequence[int]) -> list[Experiment]:
    """Fields of moving cylinders, an experiment for each mean speed; one seed each."""
    experiments = []
    for speed in movers.SPEEDS:
        drives = []
        for number in numbers:
            stem = f"dynamic/field_{number}_at_{speed:.2f}"
            world = write_scenario(
                folder / f"{stem}.world.yaml", _moving_world_text(movers.dynamic_field(number, speed))
            )
            text = barn.scenario(f"dynamic field {number}", world.name, movers.START, movers.GOAL, barn.AMONG_MOVING)
            length = movers.START.distance(movers.GOAL)
            drives.append(Drive(write_scenario(folder / f"{stem}.scenario.yaml", text), [number], length))
        experiments.append(Experiment(dynamic_name(speed), tuple(drives), folder, mapless=True))
    return experiments


def dynamic_name(speed: float) -> str:
    """What the experiment is called with this mean speed in m/s."""
    return f"dynamic fields, {speed:.2f} m/s"


def sandbox(folder: Path, nav2: Path, seeds: Sequence[int]) -> list[Experiment]:
    """Nav2's own system test, without and with the box that is not on its map."""
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
    """The shipped corner cases, each an experiment of its own."""
    return [Experiment(case_name(file), (Drive(file, seeds),), root) for file in case_files(scenarios)]


def case_files(scenarios: Path) -> list[Path]:
    """The shipped corner cases."""
    return sorted(scenarios.glob("corner_cases/*.scenario.yaml"))


def case_name(file: Path) -> str:
    """What the experiment with this corner case is called."""
    return file.name.split(".")[0].replace("_", " ")


def localizations(folder: Path, worlds: Path, seeds: Sequence[int], lost: Sequence[int]) -> list[Experiment]:
    """A tour of the shipped house told where it starts; and with the seeds `lost` told a pose 0.5 m and 20 degrees off,
    told nothing, and kidnapped.
    """

    def experiment(name: str, *drives: Drive, known: bool = False) -> Experiment:
        return Experiment(f"localization, {name}", drives, folder, (worlds,), localization=known)

    def one(stem: str, text: str, seeds: Sequence[int]) -> Drive:
        return Drive(write_scenario(folder / f"localization/{stem}.scenario.yaml", text), seeds)

    directions = {seed: float(Streams(seed).generator("direction").uniform(-np.pi, np.pi)) for seed in lost}
    misled = [one(f"misled_{n}", misled_scenario(directions[n], n % 2 == 0), [n]) for n in lost]
    tour = experiment(LOCALIZATIONS[0], one("tour", tour_scenario(), seeds), known=True)
    if not lost:
        return [tour]
    return [
        tour,
        experiment(LOCALIZATIONS[1], *misled, known=True),
        experiment(LOCALIZATIONS[2], one("start_unknown", start_unknown_scenario(), lost)),
        experiment(LOCALIZATIONS[3], one("kidnapped", kidnapped_scenario(), lost)),
    ]


def _world_text(field: ObstacleField) -> str:
    pillars = "\n".join(
        f"  - {{name: pillar, cylinder: [{CELL / 2:g}, {HEIGHT:g}], pose: {{x: {x:.3f}, y: {y:.3f}}}}}"
        for x, y in field.centers.tolist()
    )
    return f"simscen: 1\nname: field {field.number}\nobstacles:\n{pillars}\n"


def _moving_world_text(field: movers.DynamicField) -> str:
    lines = []
    for number, mover in enumerate(field.movers, start=1):
        keyframes = ", ".join(
            f"[{time:.3f}, {x:.3f}, {y:.3f}, 0]"
            for time, (x, y) in zip(mover.times.tolist(), mover.points.tolist(), strict=True)
        )
        x, y = mover.points[0].tolist()
        lines.append(
            f"  - name: cylinder {number}\n    cylinder: [{movers.RADIUS:g}, {movers.HEIGHT:g}]\n"
            f"    pose: {{x: {x:.3f}, y: {y:.3f}}}\n    move:\n      keyframes: [{keyframes}]\n"
            f"      repeat: back_and_forth\n      ease: spline\n      phase: {mover.phase:.3f} s\n"
        )
    return f"simscen: 1\nname: dynamic field {field.number}\nobjects:\n{''.join(lines)}"


def write_scenario(file: Path, text: str) -> Path:
    """The file, with this text in it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def with_stack_parameters(experiment: Experiment, name: str, stack: Mapping[str, Any], folder: Path) -> Experiment:
    """The same drives with these parameters on top of their own, as files in `folder` that extend theirs.

    The folder's name is part of theirs, as drives of two experiments may be called the same.
    Where there is no map the robot keeps the localizer that the drive has chosen for that.
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
"""Gazebo's `cardboard_box` where Nav2 puts its unmapped obstacle."""


def sandbox_scenario(name: str, box: bool) -> str:
    """The text of the scenario; world and map are found with --world-path."""
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
"""The house's dock: x, y in m, yaw in rad."""
OFF, TURNED = 0.5, math.radians(20.0)
"""How wrong the told pose is, in m and rad."""

GOALS = """\
goals:
  - {pose: sofa, timeout: 120 s}
  - {pose: kitchen, timeout: 120 s}
  - {pose: study, timeout: 120 s}
"""


def tour_scenario() -> str:
    """Three rooms; told the true start with Nav2's default covariance, AMCL's default noise."""
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


def misled_scenario(direction: float, left: bool) -> str:
    """Told a pose OFF away in this direction (rad) and TURNED; must be right again before the first goal."""
    x, y = START[0] + OFF * math.cos(direction), START[1] + OFF * math.sin(direction)
    yaw = START[2] + (TURNED if left else -TURNED)
    return f"""\
simscen: 1
name: told the wrong place
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


FINDS_ITSELF = """\
goals:
  - {pose: kitchen, timeout: 200 s}
time_limit: 210 s
pass:
  - goals_reached: {}
  - localization_error: {final: 0.2 m}
  - collisions: {max: 0, caused_by_robot: true}
"""
"""With all defaults: it is the turning of the recoveries that shows a robot that stands where it is."""


def start_unknown_scenario() -> str:
    """The robot is told nothing of where it is, and must find out while it drives to its goal."""
    return f"""\
simscen: 1
name: start unknown
world: house.world.yaml
robot: {{pose: dock, initial_estimate: unknown}}
{FINDS_ITSELF}"""


def kidnapped_scenario() -> str:
    """After 3 m the robot is carried from the corridor into the study."""
    return f"""\
simscen: 1
name: kidnapped
world: house.world.yaml
robot: {{pose: dock}}
events:
  - {{name: kidnapped, when: {{travelled: 3 m}}, do: {{kidnap: {{pose: {{x: 9.4, y: 7.3, yaw: 90 deg}}}}}}}}
{FINDS_ITSELF}"""
