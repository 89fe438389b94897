"""Loads the files that a scenario names: worlds, maps, robots, and filter masks."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel

from simscen.core.errors import Problem
from simscen.core.version import PACKAGE
from simscen.loading.loaded import CriterionMask, LoadedMap, LoadedRobot, LoadedWorld
from simscen.loading.named_places import resolve_places, unknown_places
from simscen.loading.schema.messages import did_you_mean, quoted, suggestion
from simscen.loading.schema.validate import check
from simscen.loading.spec_walk import references
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.tree import MappingNode, Node, Position, ScalarNode, entries_of, node_at, value_position
from simscen.model.robot import RobotSpec
from simscen.model.world import RosMapSpec, WorldSpec

Model = TypeVar("Model", bound=BaseModel)
Loaded = TypeVar("Loaded", LoadedMap, LoadedRobot, LoadedWorld)

SDF_SUFFIXES = (".sdf", ".world", ".sdf.xacro", ".world.xacro")
"""Suffixes of the files of Gazebo worlds."""
URDF_SUFFIXES = (".urdf", ".xacro")
"""Suffixes of URDF files."""
SHIPPED_ROBOT_SUFFIX = ".robot.yaml"
"""Suffix of the files of robots that ship with simscen."""


@dataclass
class Assets:
    """Loader of the files that a scenario names.

    If a file is unusable, a method returns None, and adds problems to `problems`. Paths in a YAML file are relative to
    the folder of this file. `position` is the position of a path or name in a YAML file.
    """

    library: Library
    problems: list[Problem] = field(default_factory=list)

    def world_of(self, world: WorldSpec | str | None, tree: MappingNode, file: Path) -> LoadedWorld | None:
        """Load the world of the scenario `file`: inline, or in the file that `world` names (see `world_file`).

        `tree` is the YAML tree of the scenario. Returns None if the scenario has no world.
        """
        node = node_at(tree, ("world",))
        if isinstance(world, WorldSpec):
            return self.complete_world(world, node, file)
        return self.world(node) if isinstance(node, ScalarNode) else None

    def world(self, node: ScalarNode) -> LoadedWorld | None:
        """Load the world in the file whose path is the value of `node`."""
        path = self._find(str(node.value), node.position)
        return None if path is None else self._load_cached(self.world_file, path)

    def world_file(self, path: Path) -> LoadedWorld | None:
        """Load the world in a `*.world.yaml`, the YAML file of a ROS map, or an SDF file, which is parsed later."""
        if path.name.endswith(SDF_SUFFIXES):
            return LoadedWorld(path.name.split(".")[0], path, sdf=path)
        if self._is_xml_file(path, "world", "if it is SDF, rename it to .sdf or .world"):
            return None
        tree = self._read_tree(path)
        if is_ros_map(tree):
            loaded = self._ros_map(tree, path)
            return LoadedWorld(path.stem, path, map=loaded) if loaded else None
        spec = self._validated(WorldSpec, tree)
        return self.complete_world(spec, tree, path) if spec and tree else None

    def complete_world(self, spec: WorldSpec, tree: Node, path: Path) -> LoadedWorld | None:
        """Return the world `spec`, whose YAML tree in the file `path` is `tree`, with its map, SDF file, and places."""
        before = len(self.problems)
        loaded_map = sdf = None
        if spec.map is not None:
            position = value_position(tree, ("map",))
            found = self._find(spec.map, position)
            loaded_map = self.map_file(found) if found else None
        if spec.sdf is not None:
            sdf = self._find(spec.sdf, value_position(tree, ("sdf",)))
        self.problems += unknown_places(spec, tree, spec.places)
        spec = resolve_places(spec, spec.places)
        name = spec.name or path.name.split(".")[0]
        mapping = tree if isinstance(tree, MappingNode) else None
        return LoadedWorld(name, path, spec, loaded_map, sdf, mapping) if len(self.problems) == before else None

    def map(self, node: ScalarNode) -> LoadedMap | None:
        """Load the ROS map in the YAML file whose path is the value of `node`."""
        path = self._find(str(node.value), node.position)
        return None if path is None else self._load_cached(self.map_file, path)

    def map_file(self, path: Path) -> LoadedMap | None:
        """Load the ROS map in a YAML file."""
        if self._is_xml_file(path, "ROS map", "use a world in SDF as `world`; `simscen world export` writes its map"):
            return None
        return self._ros_map(self._read_tree(path), path)

    def robot(self, name_or_path: str, position: Position) -> LoadedRobot | None:
        """Load the robot in the file with this path, or the shipped robot with this name."""
        if "/" in name_or_path or name_or_path.endswith((*URDF_SUFFIXES, ".yaml", ".yml")):
            path = self._find(name_or_path, position)
            return None if path is None else self._load_cached(self.robot_file, path)
        shipped_files = shipped_robots()
        if name_or_path in shipped_files:
            return self._load_cached(self.robot_file, shipped_files[name_or_path])
        hint = f"{suggestion(name_or_path, shipped_files)} (or the path of a *.robot.yaml or .urdf file)"
        message = f"no robot called {quoted(name_or_path)} ships with simscen"
        self.problems.append(Problem(*position, "SC023", message, hint))
        return None

    def robot_file(self, path: Path) -> LoadedRobot | None:
        """Load the robot in a `*.robot.yaml`, or in a `.urdf` or `.xacro` file, which is parsed later."""
        name = path.name.split(".")[0]
        if path.suffix in URDF_SUFFIXES:
            text = self.library.text(path)
            if isinstance(text, Problem) and text.message != "larger than 1 MiB":
                self.problems.append(text)
                return None
            return LoadedRobot(name, path, urdf=path)
        if self._is_xml_file(path, "robot", "if it is a URDF, rename it to .urdf; robots in SDF are not supported"):
            return None
        tree = self._read_tree(path)
        spec = self._validated(RobotSpec, tree)
        if spec is None or tree is None:
            return None
        urdf = self._find(spec.urdf, value_position(tree, ("urdf",))) if spec.urdf else None
        packages = {}
        for package, path_text in spec.packages.items():
            folder = self._find(path_text, value_position(tree, ("packages", package)), "folder")
            if folder is not None:
                packages[package] = folder
        if (spec.urdf and urdf is None) or len(packages) < len(spec.packages):
            return None
        mapping = tree if isinstance(tree, MappingNode) else None
        return LoadedRobot(name, path, spec, urdf, mapping, packages)

    def _is_xml_file(self, path: Path, kind: str, hint: str) -> bool:
        """Return whether a file is XML instead of YAML, and report an XML file as a problem.

        `kind` is the expected kind of file for the message.
        """
        name = self.library.sandbox.display_name(path)
        text = self.library.text(path)
        if isinstance(text, Problem) or not is_xml(text):
            return False
        self.problems.append(Problem(name, 1, 1, "SC004", f"this is an XML file, expected a {kind} in YAML", hint))
        return True

    def _load_cached(self, load: Callable[[Path], Loaded | None], path: Path) -> Loaded | None:
        """Return `load(path)`, or the result of an earlier call without problems."""
        key = load.__name__, path
        if key in self.library.loaded:
            known: Loaded = self.library.loaded[key]
            return known
        before = len(self.problems)
        found = load(path)
        if found is not None and len(self.problems) == before:
            self.library.loaded[key] = found
        return found

    def _ros_map(self, tree: Node | None, path: Path) -> LoadedMap | None:
        spec = self._validated(RosMapSpec, tree)
        if spec is None or tree is None:
            return None
        image = self._find(spec.image, value_position(tree, ("image",)))
        notes = []
        for key, entry in entries_of(tree).items():
            if key not in RosMapSpec.model_fields:
                hint = did_you_mean(key, RosMapSpec.model_fields) or "it is ignored, as by map_server"
                message = f"{quoted(key)} has no meaning in a ROS map"
                notes.append(Problem(*entry.key, "SC311", message, hint, "warning"))
        return LoadedMap(path, spec, image, tuple(self.library.with_source(notes))) if image else None

    def _read_tree(self, path: Path) -> Node | None:
        tree, problems = self.library.read(path)
        self.problems += problems
        return tree

    def _validated(self, model: type[Model], tree: Node | None) -> Model | None:
        if tree is None:
            return None
        spec = check(model, tree)
        if isinstance(spec, list):
            self.problems += spec
            return None
        return spec

    def _find(self, path_text: str, position: Position, kind: str = "regular file") -> Path | None:
        """Return the existing file or folder with the path `path_text`. `kind` is "regular file" or "folder"."""
        found = self.library.find(path_text, position)
        if isinstance(found, Path) and not (found.is_dir() if kind == "folder" else found.is_file()):
            found = Problem(*position, "SC001", f"not a {kind}: {quoted(path_text)}")
        if isinstance(found, Problem):
            self.problems.append(found)
            return None
        return found


def is_xml(text: str) -> bool:
    """Return whether a text is XML instead of YAML. The merge key `<<` of YAML does not count."""
    return re.match(r"\s*<[?!\w]", text) is not None


def is_ros_map(tree: Node | None) -> bool:
    """Return whether a YAML tree is the content of a ROS map file, as map_server reads it."""
    return {"image", "resolution"} <= entries_of(tree).keys()


def shipped_robots() -> dict[str, Path]:
    """Return the files of the robots that ship with simscen, by name."""
    folder = PACKAGE / "data" / "robots"
    files = sorted(folder.glob(f"*{SHIPPED_ROBOT_SUFFIX}"))
    return {path.name.removesuffix(SHIPPED_ROBOT_SUFFIX): path for path in files}


def find_criterion_masks(spec: BaseModel, tree: MappingNode, assets: Assets) -> Mapping[str, CriterionMask]:
    """Return the filter masks of the criteria under `pass`, by path as written in the file.

    `tree` is the YAML tree of `spec`. Problems are added to `assets`.
    """
    found: dict[str, CriterionMask] = {}
    for reference in references(spec):
        node = node_at(tree, reference.keys)
        if reference.target != "mask" or reference.keys[0] != "pass" or not isinstance(node, ScalarNode):
            continue
        loaded = assets.map(node)
        if loaded is None:
            continue
        first = found.setdefault(reference.name, CriterionMask(reference.keys, loaded))
        if first.map.path != loaded.path:
            message = f"{quoted(reference.name)} is also the path of another mask, in a file that this one extends"
            hint = f"write it in another way, e.g. `./{reference.name}`"
            assets.problems.append(Problem(*node.position, code="SC016", message=message, hint=hint))
    return found
