"""How to repeat a run: the command that does, from where we are."""

import os
import shlex
from pathlib import Path

from simscen.loading.files.discovery import default_root
from simscen.loading.loaded import LoadedScenario
from simscen.loading.stacks.choice import StackChoice


def repeat_command(scenario: LoadedScenario, seed: int) -> str:
    """The command that repeats a run, called from the working folder. Options are named only where they matter."""
    words = ["simscen", "run", shown(scenario.file), "--seed", str(seed)]
    if scenario.variation:
        words += ["--variation", scenario.variation]
    if scenario.root != default_root([scenario.file]):
        words += ["--root", shown(scenario.root)]
    for folder in scenario.world_path:
        words += ["--world-path", shown(folder)]
    if scenario.choice is not None:
        words += ["--stack", _seen_from_here(scenario.choice)]
    return shlex.join([*words, *(["--lenient"] if scenario.lenient else [])])


def _seen_from_here(choice: StackChoice) -> str:
    return choice.written if choice.file is None else f"{choice.name}={shown(choice.file)}"


def shown(path: Path) -> str:
    """A file or folder as seen from the working folder, or absolute where that is shorter."""
    return min(os.path.relpath(path), str(path), key=len)
