"""An experiment of `simscen bench nav`: scenarios, each with its seeds."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any


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
