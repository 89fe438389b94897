"""Read what must hold from a scenario, or from a file that says nothing else."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.loading import multirobot
from simscen.loading.files.assets import Assets, load_judged_masks
from simscen.loading.files.paths import PathSandbox
from simscen.loading.loaded import JudgedMask, LoadedRobot, LoadedWorld
from simscen.loading.places import NO_WORLD, place_references, places_of, resolve_places, unknown_places
from simscen.loading.schema.messages import quoted
from simscen.loading.schema.validate import check
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.tree import MappingNode, ScalarNode, key_position, node_at, value_position
from simscen.model.criteria_file import CriteriaSpec
from simscen.model.world import WorldSpec


@dataclass(frozen=True)
class LoadedCriteria:
    """Criteria with where they are written: `lines` in `file`, 0 for one that comes from a file it extends.

    `masks` are what they judge by, by their files as written.
    """

    file: Path
    spec: CriteriaSpec
    lines: tuple[int, ...]
    tree: MappingNode = field(repr=False)
    library: Library = field(repr=False)
    masks: Mapping[str, JudgedMask] = field(default_factory=dict)

    def of(self, robot: str) -> "LoadedCriteria":
        """What must hold for one of several robots, "" for the only one of a log. Raises InvalidInput.

        A file that says nothing of single robots holds for each.
        """
        views = multirobot.split_by_robot(self.tree)
        if robot in views:
            return _loaded(self.file, views[robot], self.library)
        if not views:
            return self
        what = f"the log has a robot {quoted(robot)}, of which nothing is said here"
        message = what if robot else "the log is of one robot, and here are several"
        problem = Problem(*key_position(self.tree, (multirobot.ROBOTS,)), code="SC030", message=message)
        raise InvalidInput(self.library.with_source([problem]))

    def surroundings(self) -> tuple[LoadedWorld | None, LoadedRobot | None]:
        """The world and the robot that the file names, if any. Raises InvalidInput."""
        assets, robot = Assets(self.library), None
        world = _world(self.spec, self.tree, self.file, assets)
        if self.spec.robot is not None:
            robot = assets.robot(self.spec.robot.model, value_position(self.tree, ("robot", "model")))
        if assets.problems:
            raise InvalidInput(self.library.with_source(assets.problems))
        return world, robot


def load_criteria(path: Path, root: Path, world_path: Sequence[Path] = ()) -> LoadedCriteria:
    """The criteria in `path`, with what it `extends` and the `defaults.yaml` beside it, as for any scenario.

    Raises InvalidInput with every problem, at the line and in the file where it is written.
    """
    library = Library(PathSandbox.around(root, world_path))
    file = library.fence.entered(path)
    if isinstance(file, Problem):
        raise InvalidInput([file])
    tree, problems = library.read(file, defaults=True)
    if problems or not isinstance(tree, MappingNode):
        spec = [] if problems or tree is None else check(CriteriaSpec, tree, multirobot.missing_in_criteria)
        raise InvalidInput(library.with_source([*problems, *(spec if isinstance(spec, list) else ())]))
    wrong = check(CriteriaSpec, tree, multirobot.missing_in_criteria)
    if isinstance(wrong, list):
        raise InvalidInput(library.with_source(wrong))
    return _loaded(file, tree, library)


def _loaded(file: Path, tree: MappingNode, library: Library) -> LoadedCriteria:
    """What a sound tree says must hold; what it names that there is not is told."""
    spec = check(CriteriaSpec, tree)
    if isinstance(spec, list):
        raise InvalidInput(library.with_source(spec))
    assets = Assets(library)
    masks = load_judged_masks(spec, tree, assets)
    if any(place_references(spec)):
        known = places_of(_world(spec, tree, file, assets))
        assets.problems += unknown_places(spec, tree, known, NO_WORLD)
        spec = resolve_places(spec, known)
    if assets.problems:
        raise InvalidInput(library.with_source(sorted(assets.problems)))
    shown = library.fence.shown(file)
    places = [value_position(tree, ("pass", index)) for index in range(len(spec.pass_))]
    return LoadedCriteria(file, spec, tuple(p.line if p.path == shown else 0 for p in places), tree, library, masks)


def _world(spec: CriteriaSpec, tree: MappingNode, file: Path, assets: Assets) -> LoadedWorld | None:
    """The world that the file names, if any."""
    node = node_at(tree, ("world",))
    if isinstance(spec.world, WorldSpec):
        return assets.own_world(spec.world, node, file)
    return assets.world(node) if spec.world is not None and isinstance(node, ScalarNode) else None
