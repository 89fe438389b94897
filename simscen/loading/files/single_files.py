"""Loading of robot and world files without a scenario, and formatting of the text of `*.world.yaml` files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from simscen.core.errors import InvalidInput, Problem
from simscen.loading.files.assets import Assets, shipped_robots
from simscen.loading.files.paths import PathSandbox
from simscen.loading.loaded import LoadedRobot, LoadedWorld
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.scalars import Dumper, to_yaml
from simscen.model.world import WorldSpec


@dataclass(frozen=True)
class RobotFile:
    """Loaded robot, and the `library` that has read its files."""

    robot: LoadedRobot
    library: Library

    @property
    def roots(self) -> tuple[Path, ...]:
        """Folders in which the files of the robot must lie: the root and the folders of `--world-path`."""
        return (self.library.sandbox.root, *self.library.sandbox.world_path)


def load_robot_file(written: str, root: Path, world_path: Sequence[Path] = ()) -> RobotFile:
    """Load the robot in a `*.robot.yaml`, `.urdf` or `.xacro` file, or a robot that ships with simscen.

    `written` is the path of the file or the name of the shipped robot. All files must lie in `root` or in a folder of
    `world_path`. Raises InvalidInput with all problems.
    """
    shipped = shipped_robots()
    library = Library(PathSandbox.around(root, world_path))
    is_shipped = written in shipped and not Path(written).exists()
    path = shipped[written] if is_shipped else library.sandbox.resolve_argument(Path(written))
    if isinstance(path, Problem):
        raise InvalidInput([path])
    if not path.is_file():
        message = "not a regular file" if path.exists() else f"no such file or shipped robot: {quoted(written)}"
        raise InvalidInput([Problem(written, 0, 0, "SC001", message, suggestion(written, shipped))])
    assets = Assets(library)
    robot = assets.robot_file(path, is_shipped)
    if robot is None or assets.problems:
        raise InvalidInput(library.with_source(sorted(assets.problems)))
    return RobotFile(robot, library)


def load_world_file(
    path: Path, root: Path, world_path: Sequence[Path] = (), unsaved: Mapping[Path, str] | None = None
) -> LoadedWorld:
    """Load the world in a `*.world.yaml`, a ROS map, or an SDF file.

    All files must lie in `root` or in a folder of `world_path`. `unsaved` are texts that replace the content of files,
    such as unsaved texts of an editor. Raises InvalidInput with all problems.
    """
    library = Library(PathSandbox.around(root, world_path), unsaved=unsaved or {})
    file = library.sandbox.resolve_argument(path)
    if isinstance(file, Problem):
        raise InvalidInput([file])
    if not file.exists():
        raise InvalidInput([Problem(str(path), 0, 0, "SC001", "no such file or directory")])
    if file.is_dir():
        raise InvalidInput([Problem(str(path), 0, 0, "SC001", "not a regular file")])
    assets = Assets(library)
    world = assets.world_file(file)
    if world is None or assets.problems:
        raise InvalidInput(library.with_source(sorted(assets.problems)))
    return world


def world_text(spec: WorldSpec) -> str:
    """Return the text of a `*.world.yaml` file with this world, without default values."""
    data = spec.model_dump(mode="json", exclude_defaults=True)
    return to_yaml(_in_order(data), CompactDumper)


def _in_order(value: Any) -> Any:
    """Return the data with the keys `simscen` and `name` at the beginning of each mapping."""
    if isinstance(value, list):
        return [_in_order(item) for item in value]
    if not isinstance(value, dict):
        return value
    first = [key for key in ("simscen", "name") if key in value]
    return {key: _in_order(value[key]) for key in dict.fromkeys((*first, *value))}


class CompactDumper(Dumper):
    """YAML dumper that writes lists without mappings in brackets, and inner mappings with a scalar in braces."""


def _represent_list(dumper: yaml.SafeDumper, value: list[Any]) -> yaml.Node:
    """Return the YAML node of a list, in brackets unless it contains mappings."""
    flat = not any(isinstance(item, dict) for item in value)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=flat)


def _represent_mapping(dumper: yaml.SafeDumper, value: dict[str, Any]) -> yaml.Node:
    """Return the YAML node of a mapping, in braces if it contains a scalar and is not the whole file."""
    flat = any(not isinstance(item, dict | list) for item in value.values()) and "simscen" not in value
    return dumper.represent_mapping("tag:yaml.org,2002:map", value, flow_style=flat)


CompactDumper.add_representer(list, _represent_list)
CompactDumper.add_representer(dict, _represent_mapping)
