"""Where `$(find package)` is: a folder of that name around the file, or in the folders that files may lie in."""

from collections.abc import Iterator
from pathlib import Path

from simscen.sim.urdf.files import Folders, Trouble
from simscen.sim.urdf.xacro.budget import Refused


def find_package(name: str, near: Path, folders: Folders) -> Path:
    """The folder of a ROS package for a file in the folder `near`; raises Refused. Nothing installed is looked for."""
    if not name.replace("_", "").replace("-", "").isalnum():
        raise Refused(f"$(find {name[:60]}): not the name of a package")
    for folder in _places(name, near, folders):
        try:
            real = folders.inside(folder)
        except Trouble:
            continue
        if real.is_dir():
            return real
    hint = f"put a folder {name} beside the robot's package, or name the one that holds it with --world-path"
    raise Refused(f"$(find {name}): there is no such package", hint)


def _places(name: str, near: Path, folders: Folders) -> Iterator[Path]:
    for folder in (near, *near.parents):
        if folder.name == name:
            yield folder
        yield folder / name
        if folder in folders.roots:
            break
    yield from (root if root.name == name else root / name for root in folders.roots)
