"""Experiments of `simscen bench nav`. An experiment is a list of drives: scenario files, each with its seeds.

The functions `write_…` of this package write scenario files to the folder `folder`, and return the experiments. All
random values of a generated field or drive are derived from its number.
"""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Drive:
    """Scenario file with the seeds of its runs.

    `reference_length` is the length in m of the reference path for the BARN score; None without a score. `world` is the
    name of the world, by which runs are grouped for confidence intervals; "" for a world that no other drive uses.
    """

    file: Path
    seeds: Sequence[int]
    reference_length: float | None = None
    world: str = ""


@dataclass(frozen=True)
class Experiment:
    """Drives that form one row of the result table.

    name:                  name in the result table
    drives:                scenario files with their seeds
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


def write_text(file: Path, text: str) -> Path:
    """Write a scenario or another text file, and return its path."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def with_stack_parameters(experiment: Experiment, name: str, stack: Mapping[str, Any], folder: Path) -> Experiment:
    """Write a copy of an experiment with other stack parameters. `name` is the name of the copy.

    The new scenarios are written to `folder`, and extend the original scenarios. `stack` is the value of the key
    `stack` in the new scenarios. For mapless drives, `stack.localizer` is ignored.
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


def corner_cases(scenarios: Path, seeds: Sequence[int]) -> list[Experiment]:
    """Return one experiment for each corner case in the folder `scenarios`."""
    return [
        Experiment(file.name.split(".")[0].replace("_", " "), (Drive(file, seeds),), scenarios.parent)
        for file in sorted(scenarios.glob("corner_cases/*.scenario.yaml"))
    ]


def write_sandbox(folder: Path, nav2: Path, seeds: Sequence[int]) -> list[Experiment]:
    """Write the drive of Nav2's system test, once without and once with a box that is not on the map.

    `nav2` is the folder with the world and map of this test.
    """
    experiments = []
    for name, stem, has_box in (("tb3_sandbox", "plain", False), ("tb3_sandbox, unmapped box", "with_box", True)):
        file = write_text(folder / f"nav2/{stem}.scenario.yaml", _sandbox_scenario(name, has_box))
        experiments.append(Experiment(name, (Drive(file, seeds),), folder, (nav2, nav2 / "models")))
    return experiments


SANDBOX_BOX = "obstacles:\n    - {name: cardboard box, box: [0.5, 0.4, 0.3], pose: {x: -1.0, y: 0.6}}\n"
"""YAML of a box like Gazebo's `cardboard_box`, at the position of the unmapped obstacle in Nav2's system test."""


def _sandbox_scenario(name: str, has_box: bool) -> str:
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
