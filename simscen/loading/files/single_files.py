"""Loads robot and world files without a scenario."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.loading.files.assets import Assets, shipped_robots
from simscen.loading.files.paths import PathSandbox, exists, is_file, is_folder
from simscen.loading.loaded import LoadedRobot, LoadedWorld
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.yaml.library import Library


@dataclass(frozen=True)
class RobotFile:
    """Loaded robot, and the `library` that has read its files."""

    robot: LoadedRobot
    library: Library

    @property
    def roots(self) -> tuple[Path, ...]:
        """Folders in which the files of the robot must lie: the root and the folders of `--world-path`."""
        return (self.library.sandbox.root, *self.library.sandbox.world_path)


def load_robot_file(name_or_path: str, root: Path, world_path: Sequence[Path] = ()) -> RobotFile:
    """Load the shipped robot with this name, or the robot in a `*.robot.yaml`, `.urdf`, or `.xacro` file.

    All files must lie in `root` or in a folder of `world_path`. Raises InvalidInput with all problems.
    """
    shipped = shipped_robots()
    library = Library(PathSandbox.around(root, world_path))
    is_shipped = name_or_path in shipped and not exists(Path(name_or_path))
    path = shipped[name_or_path] if is_shipped else library.sandbox.resolve_argument(Path(name_or_path))
    if isinstance(path, Problem):
        raise InvalidInput([path])
    if not is_file(path):
        missing = f"no such file or shipped robot: {quoted(name_or_path)}"
        message = "not a regular file" if exists(path) else missing
        raise InvalidInput([Problem(name_or_path, 0, 0, "SC001", message, suggestion(name_or_path, shipped))])
    assets = Assets(library)
    robot = assets.robot_file(path)
    if robot is None or assets.problems:
        raise InvalidInput(library.with_source(assets.problems))
    return RobotFile(robot, library)


def load_world_file(
    path: Path, root: Path, world_path: Sequence[Path] = (), unsaved: Mapping[Path, str] | None = None
) -> LoadedWorld:
    """Load the world in a `*.world.yaml`, a ROS map, or an SDF file. Raises InvalidInput with all problems.

    All files must lie in `root` or in a folder of `world_path`. `unsaved` are texts that replace the content of files,
    by absolute path.
    """
    library = Library(PathSandbox.around(root, world_path), unsaved=unsaved or {})
    file = library.sandbox.resolve_argument(path)
    if isinstance(file, Problem):
        raise InvalidInput([file])
    if not exists(file) or is_folder(file):
        message = "not a regular file" if is_folder(file) else "no such file or directory"
        raise InvalidInput([Problem(str(path), 0, 0, "SC001", message)])
    assets = Assets(library)
    world = assets.world_file(file)
    if world is None or assets.problems:
        raise InvalidInput(library.with_source(assets.problems))
    return world
