"""The files that a robot is made of."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from simscen.assets.folders import Folders, Trouble
from simscen.core.errors import InvalidInput, Problem
from simscen.sim.urdf.markup import CODE, Element, parse

URDF_BYTES = 2 * 2**20
MESH_BYTES = 20 * 2**20


@dataclass(frozen=True)
class Found:
    """Where the files are that a `*.robot.yaml` names: its URDF, and the folders of ROS packages by name."""

    urdf: Path
    packages: Mapping[str, Path]


def read_xml(path: Path, folders: Folders) -> Element:
    """The elements of a URDF or of a file that it includes, as written. Raises InvalidInput."""
    shown = folders.shown(path)
    try:
        _, data = folders.open(path, URDF_BYTES)
    except Trouble as trouble:
        raise InvalidInput([Problem(shown, 0, 0, CODE, str(trouble))]) from trouble
    return parse(data, shown)
