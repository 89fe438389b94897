"""Load a file without a scenario: a robot, a world, or criteria to judge logs; and write worlds as `*.world.yaml`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from simscen.core.errors import InvalidInput, Problem
from simscen.loading import multirobot
from simscen.loading.files.assets import Assets, find_criterion_masks, shipped_robots
from simscen.loading.files.paths import PathSandbox
from simscen.loading.known_names import NO_WORLD_HINT, place_references, places_of, resolve_places, unknown_places
from simscen.loading.loaded import CriterionMask, LoadedRobot, LoadedWorld
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.schema.validate import check
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.scalars import Dumper, to_yaml
from simscen.loading.yaml.tree import MappingNode, ScalarNode, key_position, node_at, value_position
from simscen.model.scenario import CriteriaSpec
from simscen.model.world import WorldSpec


@dataclass(frozen=True)
class RobotFile:
    """Robot and the reader of its files."""

    robot: LoadedRobot
    library: Library

    @property
    def roots(self) -> tuple[Path, ...]:
        """The root and the folders of `--world-path`."""
        return (self.library.sandbox.root, *self.library.sandbox.world_path)


def load_robot_file(written: str, root: Path, world_path: Sequence[Path] = ()) -> RobotFile:
    """Load the robot in a `*.robot.yaml`, `.urdf` or `.xacro` file, or one that ships with simscen, by name.

    Raises InvalidInput with all problems.
    """
    shipped = shipped_robots()
    library = Library(PathSandbox.around(root, world_path))
    bundled = written in shipped and not Path(written).exists()
    path = shipped[written] if bundled else library.sandbox.resolve_argument(Path(written))
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


def load_world_file(
    path: Path, root: Path, world_path: Sequence[Path] = (), unsaved: Mapping[Path, str] | None = None
) -> LoadedWorld:
    """Load the world in a `*.world.yaml`, a ROS map, or an SDF file. Raises InvalidInput with all problems.

    `unsaved` contains the texts of files that are changed in an editor, but not saved.
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
    """Return a world as the text of a `*.world.yaml`, without default values."""
    data = spec.model_dump(mode="json", exclude_defaults=True)
    return to_yaml(_in_order(data), CompactDumper)


def _in_order(value: Any) -> Any:
    """Return data with the version and names first."""
    if isinstance(value, list):
        return [_in_order(item) for item in value]
    if not isinstance(value, dict):
        return value
    first = [key for key in ("simscen", "name") if key in value]
    return {key: _in_order(value[key]) for key in dict.fromkeys((*first, *value))}


class CompactDumper(Dumper):
    """YAML writer that puts each item of a list on one line."""


def _list(dumper: yaml.SafeDumper, value: list[Any]) -> yaml.Node:
    flat = not any(isinstance(item, dict) for item in value)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=flat)


def _mapping(dumper: yaml.SafeDumper, value: dict[str, Any]) -> yaml.Node:
    flat = any(not isinstance(item, dict | list) for item in value.values()) and "simscen" not in value
    return dumper.represent_mapping("tag:yaml.org,2002:map", value, flow_style=flat)


CompactDumper.add_representer(list, _list)
CompactDumper.add_representer(dict, _mapping)


@dataclass(frozen=True)
class LoadedCriteria:
    """Criteria of a file; `lines` are their lines in `file`, 0 for criteria of a file that it extends.

    `masks` are their filter masks, by file name as written.
    """

    file: Path
    spec: CriteriaSpec
    lines: tuple[int, ...]
    tree: MappingNode = field(repr=False)
    library: Library = field(repr=False)
    masks: Mapping[str, CriterionMask] = field(default_factory=dict)

    def for_robot(self, robot: str) -> "LoadedCriteria":
        """Return the criteria for one of several robots, or "" for the only robot of a log. Raises InvalidInput.

        A file without `robots` applies to every robot.
        """
        views = multirobot.split_by_robot(self.tree)
        if robot in views:
            return _loaded(self.file, views[robot], self.library)
        if not views:
            return self
        unknown = f"the log has a robot {quoted(robot)}, which is not listed here"
        message = unknown if robot else "the log has one robot, but several are listed here"
        problem = Problem(*key_position(self.tree, (multirobot.ROBOTS,)), code="SC030", message=message)
        raise InvalidInput(self.library.with_source([problem]))

    def load_world_and_robot(self) -> tuple[LoadedWorld | None, LoadedRobot | None]:
        """Load the world and the robot that the file names, if any. Raises InvalidInput."""
        assets, robot = Assets(self.library), None
        world = _world(self.spec, self.tree, self.file, assets)
        if self.spec.robot is not None:
            robot = assets.robot(self.spec.robot.model, value_position(self.tree, ("robot", "model")))
        if assets.problems:
            raise InvalidInput(self.library.with_source(assets.problems))
        return world, robot


def load_criteria(path: Path, root: Path, world_path: Sequence[Path] = ()) -> LoadedCriteria:
    """Load the criteria in `path`, with what it `extends` and the `defaults.yaml` next to it, as for a scenario.

    Raises InvalidInput with all problems.
    """
    library = Library(PathSandbox.around(root, world_path))
    file = library.sandbox.resolve_argument(path)
    if isinstance(file, Problem):
        raise InvalidInput([file])
    tree, problems = library.read(file, defaults=True)
    if problems or not isinstance(tree, MappingNode):
        spec = [] if problems or tree is None else check(CriteriaSpec, tree, multirobot.criteria_robot_problems)
        raise InvalidInput(library.with_source([*problems, *(spec if isinstance(spec, list) else ())]))
    spec = check(CriteriaSpec, tree, multirobot.criteria_robot_problems)
    if isinstance(spec, list):
        raise InvalidInput(library.with_source(spec))
    return _loaded(file, tree, library)


def _loaded(file: Path, tree: MappingNode, library: Library) -> LoadedCriteria:
    """Return the criteria in a valid tree. Raises InvalidInput for unknown places and unusable masks."""
    spec = check(CriteriaSpec, tree)
    if isinstance(spec, list):
        raise InvalidInput(library.with_source(spec))
    assets = Assets(library)
    masks = find_criterion_masks(spec, tree, assets)
    if any(place_references(spec)):
        known = places_of(_world(spec, tree, file, assets))
        assets.problems += unknown_places(spec, tree, known, NO_WORLD_HINT)
        spec = resolve_places(spec, known)
    if assets.problems:
        raise InvalidInput(library.with_source(sorted(assets.problems)))
    display_name = library.sandbox.display_name(file)
    places = [value_position(tree, ("pass", index)) for index in range(len(spec.pass_))]
    return LoadedCriteria(
        file, spec, tuple(p.line if p.path == display_name else 0 for p in places), tree, library, masks
    )


def _world(spec: CriteriaSpec, tree: MappingNode, file: Path, assets: Assets) -> LoadedWorld | None:
    """Load the world that the file names, if any."""
    node = node_at(tree, ("world",))
    if isinstance(spec.world, WorldSpec):
        return assets.complete_world(spec.world, node, file)
    return assets.world(node) if spec.world is not None and isinstance(node, ScalarNode) else None
