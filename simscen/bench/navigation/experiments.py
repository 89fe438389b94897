"""What `simscen bench nav` drives: experiments, each a number of scenarios with seeds.

Scenarios that are generated are written as files, so that everything goes through the front door and any run of them
can be repeated by hand.
"""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from simscen.bench.navigation import barn, scenario_texts
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
                    write_scenario(folder / f"nav2/{stem}.scenario.yaml", scenario_texts.sandbox_scenario(name, box)),
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
    misled = [one(f"misled_{n}", scenario_texts.misled(directions[n], n % 2 == 0), [n]) for n in lost]
    tour = experiment(LOCALIZATIONS[0], one("tour", scenario_texts.tour(), seeds), known=True)
    if not lost:
        return [tour]
    return [
        tour,
        experiment(LOCALIZATIONS[1], *misled, known=True),
        experiment(LOCALIZATIONS[2], one("start_unknown", scenario_texts.start_unknown(), lost)),
        experiment(LOCALIZATIONS[3], one("kidnapped", scenario_texts.kidnapped(), lost)),
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


# MERGED: An experiment of `simscen bench nav`: scenarios, each with its seeds.
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
