"""An experiment once more, with other parameters of the stack."""

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from simscen.study.experiment import Experiment, written


def varied(experiment: Experiment, name: str, stack: Mapping[str, Any], folder: Path) -> Experiment:
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
        drives.append(replace(drive, file=written(file, text), world=drive.world or str(drive.file)))
    return replace(
        experiment,
        name=name,
        drives=tuple(drives),
        root=folder.parent,
        world_path=(experiment.root, *experiment.world_path),
    )
