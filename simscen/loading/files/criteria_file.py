"""Loads files with criteria (`--scenario`) by which existing logs are judged."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.loading import multirobot
from simscen.loading.files.assets import Assets, find_criterion_masks
from simscen.loading.files.paths import PathSandbox
from simscen.loading.loaded import CriterionMask, LoadedRobot, LoadedWorld
from simscen.loading.named_places import NO_WORLD_HINT, place_references, places_of, resolve_places, unknown_places
from simscen.loading.schema.messages import quoted
from simscen.loading.schema.validate import check
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.tree import MappingNode, key_position, value_position
from simscen.model.scenario import CriteriaSpec


@dataclass(frozen=True)
class LoadedCriteria:
    """Loaded criteria file."""

    file: Path
    spec: CriteriaSpec
    lines: tuple[int, ...]
    """Line of each criterion in `file`; 0 for a criterion from a file that `file` extends."""
    tree: MappingNode = field(repr=False)
    """YAML tree of `file`, merged with the files that it extends."""
    library: Library = field(repr=False)
    """Reader that has read `file`."""
    masks: Mapping[str, CriterionMask] = field(default_factory=dict)
    """Filter masks of the criteria, by path as written in the file."""

    def for_robot(self, robot: str) -> "LoadedCriteria":
        """Return the criteria for the robot `robot` of a log; "" stands for the only robot. Raises InvalidInput."""
        trees = multirobot.split_by_robot(self.tree)
        if robot in trees:
            return _load_tree(self.file, trees[robot], self.library)
        if not trees:
            return self
        unknown_robot = f"the log has a robot {quoted(robot)}, which is not listed here"
        message = unknown_robot if robot else "the log has one robot, but several are listed here"
        problem = Problem(*key_position(self.tree, (multirobot.ROBOTS,)), code="SC030", message=message)
        raise InvalidInput(self.library.with_source([problem]))

    def load_world_and_robot(self) -> tuple[LoadedWorld | None, LoadedRobot | None]:
        """Return the world and the robot that the file names; None if the file names none. Raises InvalidInput."""
        assets, robot = Assets(self.library), None
        world = assets.world_of(self.spec.world, self.tree, self.file)
        if self.spec.robot is not None:
            robot = assets.robot(self.spec.robot.model, value_position(self.tree, ("robot", "model")))
        if assets.problems:
            raise InvalidInput(self.library.with_source(assets.problems))
        return world, robot


def load_criteria(path: Path, root: Path, world_path: Sequence[Path] = ()) -> LoadedCriteria:
    """Load the criteria in a file, merged with `extends` and `defaults.yaml`. Raises InvalidInput with all problems."""
    library = Library(PathSandbox.around(root, world_path))
    file = library.sandbox.resolve_argument(path)
    if isinstance(file, Problem):
        raise InvalidInput([file])
    tree, problems = library.read(file, defaults=True)
    if not problems and tree is not None:
        spec = check(CriteriaSpec, tree, multirobot.criteria_robot_problems)
        problems = spec if isinstance(spec, list) else []
    if problems or not isinstance(tree, MappingNode):
        raise InvalidInput(library.with_source(problems))
    return _load_tree(file, tree, library)


def _load_tree(file: Path, tree: MappingNode, library: Library) -> LoadedCriteria:
    """Return the criteria in the YAML tree of `file`. Raises InvalidInput, for example for unknown places."""
    spec = check(CriteriaSpec, tree)
    if isinstance(spec, list):
        raise InvalidInput(library.with_source(spec))
    assets = Assets(library)
    masks = find_criterion_masks(spec, tree, assets)
    if any(place_references(spec)):
        known = places_of(assets.world_of(spec.world, tree, file))
        assets.problems += unknown_places(spec, tree, known, NO_WORLD_HINT)
        spec = resolve_places(spec, known)
    if assets.problems:
        raise InvalidInput(library.with_source(assets.problems))
    display_name = library.sandbox.display_name(file)
    positions = [value_position(tree, ("pass", index)) for index in range(len(spec.pass_))]
    lines = tuple(position.line if position.path == display_name else 0 for position in positions)
    return LoadedCriteria(file, spec, lines, tree, library, masks)
