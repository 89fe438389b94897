"""An experiment of `simscen bench nav`: scenarios, each with its seeds."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Drive:
    """A scenario file, the seeds to run it with, and BARN's reference length in metres where it has one.

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


def written(file: Path, text: str) -> Path:
    """The file, with this text in it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file
