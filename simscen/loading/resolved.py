"""A scenario as one self-contained text: what a log and an output folder keep of it."""

from collections.abc import Mapping
from dataclasses import replace

from simscen.core.errors import InvalidInput
from simscen.loading.compose import compose
from simscen.loading.document import Library
from simscen.loading.loaded import LoadedScenario
from simscen.loading.paths import Fence
from simscen.loading.placing import placed_criteria, places_of
from simscen.loading.plugins import absent
from simscen.loading.robots import each_of
from simscen.loading.tree import Fields, Node
from simscen.loading.validation import Model, check
from simscen.loading.writing import to_yaml
from simscen.model.criteria_file import CriteriaSpec
from simscen.model.scenario import ScenarioSpec

JUDGING = frozenset({"criterion", "metric"})
"""The kinds of types that a judgement needs."""
_JUDGED = frozenset({"simscen", "pass", "metrics", "expected"})


def resolved_text(loaded: LoadedScenario) -> str:
    """The file as it was written; where it `extends` others or takes `defaults.yaml`, all of them merged.

    Where criteria name places, their poses stand there instead: it is judged by without its world.
    """
    own, _ = compose(loaded.text, loaded.path)
    plain = placed_criteria(loaded.tree.plain, _checked(ScenarioSpec, loaded.tree), places_of(loaded.world))
    if isinstance(own, Fields) and own.plain == plain:
        return loaded.text
    return to_yaml(plain)


def whole_text(loaded: LoadedScenario) -> str:
    """Likewise, with all the variations that the file has instead of the values of one."""
    if not loaded.variation:
        return resolved_text(loaded)
    own, _ = compose(loaded.text, loaded.path)
    tree, _ = Library(Fence.around(loaded.root, loaded.world_path)).read(loaded.file, defaults=True)
    return loaded.text if tree is None or own is None or own.plain == tree.plain else to_yaml(tree.plain)


def spec_of_text(text: str, name: str) -> ScenarioSpec:
    """The specification in a resolved text; `name` is what problems call it. Raises InvalidInput."""
    return _checked(ScenarioSpec, _read(text, name))


def parts_of_text(text: str, name: str, robot: str = "") -> tuple[CriteriaSpec, Fields]:
    """The specification in a resolved text, of one of several robots if named, and the tree that says where it stands.

    A file of criteria will do. Raises InvalidInput.
    """
    tree = _read(text, name)
    if isinstance(tree, Fields) and robot:
        tree = each_of(tree).get(robot, tree)
    spec = _checked(CriteriaSpec, tree)
    assert isinstance(tree, Fields)
    return spec, tree


def criteria_of_text(text: str, name: str, facts: Mapping[str, str], robot: str = "") -> CriteriaSpec:
    """What a resolved text says must hold; `name` is what problems call it, `facts` are those of the log it is from,
    `robot` the one of several that is meant.

    Only that is looked at: what else of installed packages the run was made with need not be there to judge it. Raises
    InvalidInput, also where a criterion is not installed that judged the run then.
    """
    if missing := absent(facts, JUDGING):
        raise InvalidInput([replace(problem, path=name) for problem in missing])
    tree = _read(text, name)
    if isinstance(tree, Fields):
        tree = each_of(tree)[robot] if robot else tree
        tree = replace(tree, entries={key: entry for key, entry in tree.entries.items() if key in _JUDGED})
    return _checked(CriteriaSpec, tree)


def _read(text: str, name: str) -> Node:
    tree, problems = compose(text, name)
    if tree is None or problems:
        raise InvalidInput(problems)
    return tree


def _checked(model: type[Model], tree: Node) -> Model:
    spec = check(model, tree)
    if isinstance(spec, list):
        raise InvalidInput(spec)
    return spec
