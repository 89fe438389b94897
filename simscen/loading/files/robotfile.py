"""Load a robot file by itself."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.loading.files.assets import Assets, shipped_robots
from simscen.loading.files.paths import PathSandbox
from simscen.loading.loaded import LoadedRobot
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.yaml.library import Library


@dataclass(frozen=True)
class RobotFile:
    """Robot and the reader of its files."""

    robot: LoadedRobot
    library: Library

    @property
    def roots(self) -> tuple[Path, ...]:
        """The root and the folders of `--world-path`."""
        return (self.library.fence.root, *self.library.fence.world_path)


def load_robot_file(written: str, root: Path, world_path: Sequence[Path] = ()) -> RobotFile:
    """Load the robot in a `*.robot.yaml`, `.urdf` or `.xacro` file, or one that ships with simscen, by name.

    Raises InvalidInput with all problems.
    """
    shipped = shipped_robots()
    library = Library(PathSandbox.around(root, world_path))
    bundled = written in shipped and not Path(written).exists()
    path = shipped[written] if bundled else library.fence.entered(Path(written))
    if isinstance(path, Problem):
        raise InvalidInput([path])
    if not path.is_file():
        message = "not a regular file" if path.exists() else f"no such file or shipped robot: {quoted(written)}"
        raise InvalidInput([Problem(written, 0, 0, "SC001", message, suggestion(written, shipped))])
    assets = Assets(library)
    robot = assets.robot_file(path, bundled)
    if robot is None or assets.problems:
        raise InvalidInput(library.with_source(sorted(assets.problems)))
    return RobotFile(robot, library)
